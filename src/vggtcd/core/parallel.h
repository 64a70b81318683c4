// SPDX-License-Identifier: Apache-2.0
// parallel_for over a fixed partition: the chunks depend on the range and the grain alone, never on
// the number of threads, so a reduction that adds up chunk results in chunk order has the same bits
// on one thread and on sixteen.
#pragma once

#include <cstdint>
#include <functional>

namespace vggtcd {

// The number of threads that parallel_for uses, the calling one included. Default: the number of
// processors this process may run on. Not to be called from inside a parallel_for.
int num_threads();
void set_num_threads(int count);  // count >= 1, else Error{kUsage}

// Starts the threads now instead of in the first parallel_for and returns num_threads(), which is
// less than before where the system (a limit on processes or memory) gives fewer.
int start_threads();

// Calls body(begin, end) for each chunk [begin, end) of [0, size), chunk k = [k*grain,
// (k+1)*grain). Returns when all are done. The first exception of a chunk is thrown here and no
// further chunk is started; likewise Error{kInterrupted}. A parallel_for inside a parallel_for runs
// serially.
void parallel_for(int64_t size, int64_t grain, const std::function<void(int64_t, int64_t)>& body);

// The same, telling the body which worker runs it (0 <= worker < num_threads()), for scratch
// memory.
void parallel_for_workers(int64_t size, int64_t grain,
                          const std::function<void(int64_t, int64_t, int)>& body);

// The number of chunks of such a loop, to size an array of per-chunk partial results.
constexpr int64_t num_chunks(int64_t size, int64_t grain) { return (size + grain - 1) / grain; }

}  // namespace vggtcd
