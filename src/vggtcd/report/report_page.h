// SPDX-License-Identifier: Apache-2.0
// The report page: one HTML file that shows the change (docs/formats.md, "report.html").
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "vggtcd/core/options.h"
#include "vggtcd/report/report_input.h"

namespace vggtcd {

struct ReportOptions {
  int64_t max_points = 1500000;      // of both epochs together; >= 0
  int64_t max_bytes = 25 * 1000000;  // of the page; >= 1 MB; photos take at most half

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("max_points", self.max_points,
          "Points in the page, both epochs together. Changed points go first; the page says what "
          "was left out.");
    field("max_bytes", self.max_bytes,
          "Size of the page. Photos shrink to half of it at most, then points are left out.");
  };
  void validate() const;
};

struct ReportSize {
  int64_t bytes = 0;
  int64_t points = 0;        // of both results
  int64_t points_shown = 0;  // of them in the page
};

// The data block: JSON in which "<", ">" and "&" are escaped, so that no text in it can end the
// element it stands in. The same input and options give the same bytes on any number of threads.
struct ReportData {
  std::string json;
  ReportSize size;  // bytes: of the JSON
};
ReportData make_report_data(const ReportInput& input, const ReportOptions& options);

// The whole page, written aside and renamed. Throws Error{kOutput}.
ReportSize write_report(const ReportInput& input, const ReportOptions& options,
                        const std::filesystem::path& path);

}  // namespace vggtcd
