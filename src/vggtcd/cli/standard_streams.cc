// SPDX-License-Identifier: Apache-2.0
// Standard output through stdio with every result looked at, standard error with none.
#include "vggtcd/cli/standard_streams.h"

#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "vggtcd/core/error.h"
#include "vggtcd/io/quote.h"

namespace vggtcd::cli {
namespace {

int g_lost_answer = 0;  // errno of the first write that failed

iovec piece_of(std::string_view text) { return {const_cast<char*>(text.data()), text.size()}; }

// Whatever happens, errno stays as it was: a failure may be on its way to be told.
template <size_t N>
void write_pieces(std::array<iovec, N> pieces) noexcept {
  const int before = errno;
  for (size_t first = 0; first < N;) {
    ssize_t written = writev(STDERR_FILENO, &pieces[first], static_cast<int>(N - first));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) break;
    for (; first < N && static_cast<size_t>(written) >= pieces[first].iov_len; ++first) {
      written -= static_cast<ssize_t>(pieces[first].iov_len);
    }
    if (first == N) break;
    pieces[first].iov_base = static_cast<char*>(pieces[first].iov_base) + written;
    pieces[first].iov_len -= static_cast<size_t>(written);
  }
  errno = before;
}

}  // namespace

void open_closed_streams() {
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
    // The lowest number that is free is this one, since those below are open.
    if (fcntl(stream, F_GETFD) < 0) open("/dev/null", O_RDWR);
  }
}

void write_answer(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written && g_lost_answer == 0) g_lost_answer = errno;
}

void finish_answer() {
  if (std::fflush(stdout) != 0 && g_lost_answer == 0) g_lost_answer = errno;
  if (g_lost_answer == 0) return;
  throw_error(ErrorCode::kOutput,
              "standard output cannot be written: {}; what was to be printed there is lost",
              std::strerror(g_lost_answer));
}

void tell(std::string_view prefix, std::string_view text) noexcept {
  try {
    const std::string line = escaped(text);
    write_pieces<3>({piece_of(prefix), piece_of(line), piece_of("\n")});
  } catch (...) {  // no memory for it
    write_pieces<3>({piece_of(prefix), piece_of(text), piece_of("\n")});
  }
}

void tell_raw(std::string_view text) noexcept { write_pieces<1>({piece_of(text)}); }

}  // namespace vggtcd::cli
