// SPDX-License-Identifier: Apache-2.0
// Interruption: Ctrl-C, or a file that is lost while it is read, sets a flag; long work looks at it
// and stops by throwing.
#pragma once

namespace vggtcd {

// Asks all work of this process to stop. Safe to call from a signal handler.
void request_interrupt() noexcept;
void clear_interrupt() noexcept;
bool interrupt_requested() noexcept;

// The same where input that lies in memory is not there any more: throw_if_interrupted() throws
// Error{kInput} with `what`, which must live as long as the process. Safe in a signal handler.
void request_stop_input_lost(const char* what) noexcept;

// Throws Error{kInterrupted} if an interrupt was requested. parallel_for calls it between chunks,
// and writers before a file is complete.
void throw_if_interrupted();

// SIGINT and SIGTERM call request_interrupt() from now on; a second one ends the process at once.
void install_interrupt_handler();

}  // namespace vggtcd
