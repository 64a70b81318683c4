// SPDX-License-Identifier: Apache-2.0
// Interruption: Ctrl-C sets a flag, long work looks at it and stops by throwing.
#pragma once

namespace vggtcd {

// Asks all work of this process to stop. Safe to call from a signal handler.
void request_interrupt() noexcept;
void clear_interrupt() noexcept;
bool interrupt_requested() noexcept;

// Throws Error{kInterrupted} if an interrupt was requested. parallel_for calls it between chunks.
void throw_if_interrupted();

// SIGINT and SIGTERM call request_interrupt() from now on; a second one ends the process at once.
void install_interrupt_handler();

}  // namespace vggtcd
