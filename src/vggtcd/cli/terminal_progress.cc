// SPDX-License-Identifier: Apache-2.0
// The four displays of progress. The JSON lines are described in docs/formats.md.
#include "vggtcd/cli/terminal_progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "vggtcd/core/timer.h"

namespace vggtcd::cli {
namespace {

// "4 s", "1 min 20 s"
std::string duration_text(double seconds) {
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  const int whole = static_cast<int>(seconds + 0.5);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole % 3600 / 60);
}

class NoticesOnly : public ProgressSink {
 public:
  void stage_started(std::string_view) override {}
  void stage_advanced(std::string_view, double) override {}
  void stage_finished(std::string_view, double) override {}
  void notice(std::string_view message) override { fmt::print(stderr, "note: {}\n", message); }
};

class PlainLines : public NoticesOnly {
 public:
  void stage_finished(std::string_view stage, double seconds) override {
    fmt::print(stderr, "{}: {}\n", stage, duration_text(seconds));
  }
  void stage_started(std::string_view) override {
    started_s_ = monotonic_seconds();
    shown_s_ = started_s_;
  }
  void stage_advanced(std::string_view stage, double fraction) override {
    constexpr double kEverySeconds = 30;
    const double now = monotonic_seconds();
    if (now - shown_s_ < kEverySeconds || fraction <= 0 || fraction >= 1) return;
    shown_s_ = now;
    const double left = (now - started_s_) * (1 - fraction) / fraction;
    fmt::print(stderr, "{}: {:.0f} %, {} left\n", stage, 100 * fraction, duration_text(left));
  }

 private:
  double started_s_ = 0;
  double shown_s_ = 0;
};

class LiveLine : public ProgressSink {
 public:
  ~LiveLine() override { erase(); }
  void stage_started(std::string_view stage) override {
    started_s_ = monotonic_seconds();
    draw(fmt::format("{} ...", stage));
  }
  void stage_advanced(std::string_view stage, double fraction) override {
    const double now = monotonic_seconds();
    if (now - drawn_s_ < 0.1) return;
    constexpr int kWidth = 24;
    const int full = static_cast<int>(fraction * kWidth);
    std::string left;
    if (fraction > 0.02 && now - started_s_ > 1) {
      left =
          fmt::format(", {} left", duration_text((now - started_s_) * (1 - fraction) / fraction));
    }
    draw(fmt::format("{} [{}{}] {:.0f} %{}", stage, std::string(static_cast<size_t>(full), '='),
                     std::string(static_cast<size_t>(kWidth - full), ' '), 100 * fraction, left));
  }
  void stage_finished(std::string_view stage, double seconds) override {
    erase();
    fmt::print(stderr, "{}: {}\n", stage, duration_text(seconds));
  }
  void notice(std::string_view message) override {
    erase();
    fmt::print(stderr, "note: {}\n", message);
  }

 private:
  void draw(const std::string& line) {
    fmt::print(stderr, "\r\x1b[K{}", line);
    std::fflush(stderr);
    drawn_s_ = monotonic_seconds();
    drawn_ = true;
  }
  void erase() {
    if (drawn_) fmt::print(stderr, "\r\x1b[K");
    drawn_ = false;
  }
  double started_s_ = 0;
  double drawn_s_ = 0;
  bool drawn_ = false;
};

class JsonLines : public ProgressSink {
 public:
  void stage_started(std::string_view stage) override {
    write({{"event", "stage_started"}, {"stage", stage}});
  }
  void stage_advanced(std::string_view stage, double fraction) override {
    write({{"event", "stage_advanced"}, {"stage", stage}, {"fraction", fraction}});
  }
  void stage_finished(std::string_view stage, double seconds) override {
    write({{"event", "stage_finished"}, {"stage", stage}, {"seconds", seconds}});
  }
  void notice(std::string_view message) override {
    write({{"event", "notice"}, {"message", message}});
  }

 private:
  static void write(const nlohmann::ordered_json& line) {
    constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;
    fmt::print(stderr, "{}\n", line.dump(-1, ' ', false, kReplace));
  }
};

}  // namespace

std::unique_ptr<ProgressSink> make_progress(std::string_view mode) {
  if (mode == "json") return std::make_unique<JsonLines>();
  if (mode == "none") return std::make_unique<NoticesOnly>();
  if (mode == "auto" && isatty(STDERR_FILENO)) return std::make_unique<LiveLine>();
  return std::make_unique<PlainLines>();
}

}  // namespace vggtcd::cli
