// SPDX-License-Identifier: Apache-2.0
// Interruption: one process-wide flag, set by a signal handler or by the embedding program.
#include "vggtcd/core/interrupt.h"

#include <atomic>
#include <csignal>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "used in a signal handler");

void on_signal(int signal) {
  request_interrupt();
  std::signal(signal, SIG_DFL);
}

}  // namespace

void request_interrupt() noexcept { g_interrupted.store(true, std::memory_order_relaxed); }
void clear_interrupt() noexcept { g_interrupted.store(false, std::memory_order_relaxed); }
bool interrupt_requested() noexcept { return g_interrupted.load(std::memory_order_relaxed); }

void throw_if_interrupted() {
  if (interrupt_requested()) throw Error(ErrorCode::kInterrupted, "interrupted");
}

void install_interrupt_handler() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

}  // namespace vggtcd
