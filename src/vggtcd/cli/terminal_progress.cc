// SPDX-License-Identifier: Apache-2.0
// The four displays of progress. The JSON lines are described in docs/formats.md.
#include "vggtcd/cli/terminal_progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/core/job_clock.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/io/quote.h"

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

std::string whole_seconds(double seconds) {
  return seconds < 10 ? fmt::format("{:.0f} s", seconds) : duration_text(seconds);
}

class NoticesOnly : public ProgressSink {
 public:
  void stage_started(std::string_view) override {}
  void stage_advanced(std::string_view, double) override {}
  void stage_finished(std::string_view, double) override {}
  void notice(std::string_view message) override { tell("note: ", message); }
};

// What the displays share: the clock of stage and job.
class TimedProgress : public ProgressSink {
 public:
  void job_planned(const std::vector<PlannedStage>& stages) override { clock_.planned(stages); }
  void stage_started(std::string_view stage) override {
    clock_.started(stage, monotonic_seconds());
    show_started(stage);
  }
  void stage_advanced(std::string_view stage, double fraction) override {
    clock_.advanced(fraction);
    show_advanced(stage, fraction);
  }
  void stage_finished(std::string_view stage, double seconds) override {
    clock_.finished(monotonic_seconds());
    show_finished(stage, seconds);
  }

 protected:
  virtual void show_started(std::string_view stage) = 0;
  virtual void show_advanced(std::string_view stage, double fraction) = 0;
  virtual void show_finished(std::string_view stage, double seconds) = 0;

  std::optional<double> job_seconds_left() const {
    return clock_.job_seconds_left(monotonic_seconds());
  }
  // ", 12 s left", or nothing if that is not known yet.
  std::string stage_left_text() const {
    const std::optional<double> left = clock_.stage_seconds_left(monotonic_seconds());
    return left ? fmt::format(", {} left", duration_text(*left)) : std::string();
  }
  // "; about 1 min 20 s to go", of the whole job.
  std::string job_left_text() const {
    const std::optional<double> left = job_seconds_left();
    return left ? fmt::format("; about {} to go", whole_seconds(std::max(1.0, *left)))
                : std::string();
  }

 private:
  JobClock clock_;
};

class PlainLines : public TimedProgress {
 public:
  void notice(std::string_view message) override { tell("note: ", message); }

 protected:
  void show_started(std::string_view) override { shown_s_ = monotonic_seconds(); }
  void show_advanced(std::string_view stage, double fraction) override {
    constexpr double kEverySeconds = 30;
    const double now = monotonic_seconds();
    if (now - shown_s_ < kEverySeconds || fraction <= 0 || fraction >= 1) return;
    shown_s_ = now;
    tell(stage, fmt::format(": {:.0f} %{}{}", 100 * fraction, stage_left_text(), job_left_text()));
  }
  void show_finished(std::string_view stage, double seconds) override {
    constexpr double kWorthSayingS = 3;
    const bool is_long = job_seconds_left().value_or(0) >= kWorthSayingS;
    tell(stage, fmt::format(": {}{}", duration_text(seconds), is_long ? job_left_text() : ""));
  }

 private:
  double shown_s_ = 0;
};

class LiveLine : public TimedProgress {
 public:
  ~LiveLine() override { erase(); }
  void notice(std::string_view message) override {
    erase();
    tell("note: ", message);
  }

 protected:
  void show_started(std::string_view stage) override {
    draw(fmt::format("{} ...{}", stage, job_left_text()));
  }
  void show_advanced(std::string_view stage, double fraction) override {
    constexpr double kEverySeconds = 0.1;
    constexpr int kWidth = 16;
    if (monotonic_seconds() - drawn_s_ < kEverySeconds) return;
    const int full = static_cast<int>(fraction * kWidth);
    draw(fmt::format("{} [{}{}] {:.0f} %{}{}", stage, std::string(static_cast<size_t>(full), '='),
                     std::string(static_cast<size_t>(kWidth - full), ' '), 100 * fraction,
                     stage_left_text(), job_left_text()));
  }
  void show_finished(std::string_view stage, double seconds) override {
    erase();
    tell(stage, ": " + duration_text(seconds));
  }

 private:
  // A line that is longer than the terminal would wrap and could not be erased.
  static size_t terminal_columns() {
    winsize size{};
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
    return size.ws_col;
  }
  void draw(const std::string& line) {
    tell_raw("\r\x1b[K" + line.substr(0, terminal_columns() - 1));
    drawn_s_ = monotonic_seconds();
    drawn_ = true;
  }
  void erase() {
    if (drawn_) tell_raw("\r\x1b[K");
    drawn_ = false;
  }
  double drawn_s_ = 0;
  bool drawn_ = false;
};

class JsonLines : public TimedProgress {
 public:
  void job_planned(const std::vector<PlannedStage>& stages) override {
    TimedProgress::job_planned(stages);
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const PlannedStage& stage : stages) {
      list.push_back({{"stage", stage.stage}, {"seconds", stage.seconds}});
    }
    write({{"event", "job_planned"}, {"stages", std::move(list)}});
  }
  void notice(std::string_view message) override {
    write({{"event", "notice"}, {"message", escaped(message)}});
  }

 protected:
  void show_started(std::string_view stage) override {
    write({{"event", "stage_started"}, {"stage", stage}});
  }
  void show_advanced(std::string_view stage, double fraction) override {
    write({{"event", "stage_advanced"}, {"stage", stage}, {"fraction", fraction}});
  }
  void show_finished(std::string_view stage, double seconds) override {
    write({{"event", "stage_finished"},
           {"stage", stage},
           {"seconds", seconds},
           {"peak_memory_bytes", peak_memory_bytes()}});
  }

 private:
  void write(nlohmann::ordered_json line) const {
    if (const std::optional<double> left = job_seconds_left(); left && line.contains("stage")) {
      line["job_seconds_left"] = *left;
    }
    constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;
    tell("", line.dump(-1, ' ', false, kReplace));
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
