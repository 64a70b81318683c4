// SPDX-License-Identifier: Apache-2.0
// Progress: the silent sink and the scope that reports one stage.
#include "vggtcd/core/progress.h"

#include <algorithm>
#include <exception>
#include <new>

#include "vggtcd/core/timer.h"

namespace vggtcd {
namespace {

class SilentProgress : public ProgressSink {
 public:
  void stage_started(std::string_view) override {}
  void stage_advanced(std::string_view, double) override {}
  void stage_finished(std::string_view, double) override {}
  void notice(std::string_view) override {}
};

}  // namespace

ProgressSink& silent_progress() {
  static SilentProgress sink;
  return sink;
}

ProgressStage::ProgressStage(ProgressSink& sink, std::string name)
    : sink_(sink),
      name_(std::move(name)),
      started_s_(monotonic_seconds()),
      exceptions_(std::uncaught_exceptions()) {
  sink_.stage_started(name_);
}

ProgressStage::~ProgressStage() {
  if (std::uncaught_exceptions() > exceptions_) return;
  try {
    sink_.stage_finished(name_, seconds());
  } catch (const std::bad_alloc&) {
    // Too little memory for the words: the work says so when it needs some itself.
  }
}

void ProgressStage::advance(double fraction) {
  fraction_ = std::max(fraction_, std::clamp(fraction, 0.0, 1.0));
  sink_.stage_advanced(name_, fraction_);
}

double ProgressStage::seconds() const { return monotonic_seconds() - started_s_; }

}  // namespace vggtcd
