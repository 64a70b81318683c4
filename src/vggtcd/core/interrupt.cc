// SPDX-License-Identifier: Apache-2.0
// Interruption: one process-wide flag, set by a signal handler or by the embedding program.
#include "vggtcd/core/interrupt.h"

#include <atomic>
#include <csignal>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

std::atomic<bool> g_interrupted{false};
std::atomic<const char*> g_input_lost{nullptr};
static_assert(std::atomic<bool>::is_always_lock_free &&
                  std::atomic<const char*>::is_always_lock_free,
              "used in signal handlers");

void on_signal(int signal) {
  request_interrupt();
  std::signal(signal, SIG_DFL);
}

}  // namespace

void request_interrupt() noexcept { g_interrupted.store(true, std::memory_order_relaxed); }
void request_stop_input_lost(const char* what) noexcept {
  g_input_lost.store(what, std::memory_order_relaxed);
  g_interrupted.store(true, std::memory_order_release);
}
void clear_interrupt() noexcept {
  g_interrupted.store(false, std::memory_order_relaxed);
  g_input_lost.store(nullptr, std::memory_order_relaxed);
}
bool interrupt_requested() noexcept { return g_interrupted.load(std::memory_order_acquire); }

void throw_if_interrupted() {
  if (!interrupt_requested()) return;
  if (const char* what = g_input_lost.load(std::memory_order_relaxed)) {
    throw Error(ErrorCode::kInput, what);
  }
  throw Error(ErrorCode::kInterrupted, "interrupted");
}

void install_interrupt_handler() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
}

}  // namespace vggtcd
