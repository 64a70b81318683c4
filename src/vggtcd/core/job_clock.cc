// SPDX-License-Identifier: Apache-2.0
// JobClock: the time left of a whole job, from a plan of its stages and from how fast those done
// were.
#include "vggtcd/core/job_clock.h"

#include <algorithm>

namespace vggtcd {
namespace {

constexpr double kTellingFraction = 0.02;  // less of a stage says nothing about the rest

}  // namespace

void JobClock::planned(const std::vector<PlannedStage>& stages) {
  stages_ = stages;
  next_ = 0;
  at_hand_.reset();
}

void JobClock::started(std::string_view stage, double now_s) {
  running_ = true;
  started_s_ = now_s;
  fraction_ = 0;
  const auto at = std::find_if(stages_.begin() + static_cast<std::ptrdiff_t>(next_), stages_.end(),
                               [&](const PlannedStage& planned) { return planned.stage == stage; });
  at_hand_.reset();
  if (at == stages_.end()) return;
  at_hand_ = static_cast<size_t>(at - stages_.begin());
  next_ = *at_hand_ + 1;
}

void JobClock::finished(double now_s) {
  running_ = false;
  if (!at_hand_) return;
  planned_done_s_ += stages_[*at_hand_].seconds;
  really_done_s_ += now_s - started_s_;
  at_hand_.reset();
}

// 1 while little is done: the first short stages say more about caches than about the machine.
double JobClock::slowness() const {
  constexpr double kDoubtS = 2;
  return (really_done_s_ + kDoubtS) / (planned_done_s_ + kDoubtS);
}

std::optional<double> JobClock::stage_seconds_left(double now_s) const {
  if (!running_ || fraction_ < kTellingFraction) return std::nullopt;
  return (now_s - started_s_) * (1 - fraction_) / fraction_;
}

std::optional<double> JobClock::job_seconds_left(double now_s) const {
  if (stages_.empty()) return std::nullopt;
  double left = 0;
  for (size_t i = next_; i < stages_.size(); ++i) left += slowness() * stages_[i].seconds;
  if (const std::optional<double> stage = stage_seconds_left(now_s)) {
    left += *stage;
  } else if (at_hand_) {
    left += std::max(0.0, slowness() * stages_[*at_hand_].seconds - (now_s - started_s_));
  }
  return left;
}

}  // namespace vggtcd
