// SPDX-License-Identifier: Apache-2.0
// A plain pool of std::threads: what parallel_for needs and no more (visible to ThreadSanitizer,
// unlike libgomp). The system may give fewer threads than were asked for; the work goes on then.
#include "vggtcd/core/parallel.h"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"

namespace vggtcd {
namespace {

thread_local bool t_inside_parallel_for = false;

struct Job {
  int64_t size;
  int64_t grain;
  const std::function<void(int64_t, int64_t, int)>* body;
  std::atomic<int64_t> next_chunk{0};
  std::atomic<bool> stop{false};
  std::mutex mutex{};
  std::exception_ptr error{};

  void run(int worker) {
    t_inside_parallel_for = true;
    const int64_t chunks = num_chunks(size, grain);
    while (!stop.load(std::memory_order_relaxed)) {
      const int64_t chunk = next_chunk.fetch_add(1, std::memory_order_relaxed);
      if (chunk >= chunks) break;
      try {
        throw_if_interrupted();
        (*body)(chunk * grain, std::min(size, (chunk + 1) * grain), worker);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!error) error = std::current_exception();
        stop.store(true, std::memory_order_relaxed);
      }
    }
    t_inside_parallel_for = false;
  }
};

class Pool {
 public:
  explicit Pool(size_t helpers) {
    if (start(helpers)) return;
    // At the limit no library could start a thread of its own, and no memory would be left to work
    // with: half of what was given goes back.
    keep(threads_.size() / 2);
  }
  ~Pool() { keep(0); }
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  int workers() const { return 1 + static_cast<int>(threads_.size()); }

  void run(Job& job) {
    const std::lock_guard one_job_at_a_time(run_mutex_);
    {
      const std::lock_guard lock(mutex_);
      job_ = &job;
      running_ = static_cast<int>(threads_.size());
      ++generation_;
    }
    wake_.notify_all();
    job.run(0);
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return running_ == 0; });
    job_ = nullptr;
  }

 private:
  // Whether the system gave them all. Threads that run are joined in any case: one that is not
  // would end the program, or wait for ever on a condition that is gone.
  bool start(size_t helpers) {
    try {
      kept_ = helpers;
      threads_.reserve(helpers);
      while (threads_.size() < helpers) {
        threads_.emplace_back(
            [this, worker = static_cast<int>(threads_.size()) + 1] { loop(worker); });
      }
      return true;
    } catch (const std::system_error&) {  // a limit on threads
      return false;
    } catch (const std::bad_alloc&) {
      return false;
    }
  }

  void keep(size_t helpers) {
    {
      const std::lock_guard lock(mutex_);
      kept_ = helpers;
    }
    wake_.notify_all();
    for (; threads_.size() > helpers; threads_.pop_back()) threads_.back().join();
  }

  void loop(int worker) {
    uint64_t seen = 0;
    std::unique_lock lock(mutex_);
    const auto is_superfluous = [&] { return static_cast<size_t>(worker) > kept_; };
    while (true) {
      wake_.wait(lock, [&] { return is_superfluous() || generation_ != seen; });
      if (is_superfluous()) return;
      seen = generation_;
      Job* job = job_;
      lock.unlock();
      job->run(worker);
      lock.lock();
      if (--running_ == 0) done_.notify_one();
    }
  }

  std::vector<std::thread> threads_;
  std::mutex run_mutex_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable done_;
  Job* job_ = nullptr;
  int running_ = 0;
  uint64_t generation_ = 0;
  size_t kept_ = 0;  // helpers with a larger number end
};

int available_processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof(set), &set) == 0) return std::max(1, CPU_COUNT(&set));
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

std::mutex g_pool_mutex;
int g_num_threads = 0;  // 0: not yet asked
std::shared_ptr<Pool> g_pool;

std::shared_ptr<Pool> pool() {
  const int threads = num_threads();
  const std::lock_guard lock(g_pool_mutex);
  if (!g_pool) {
    g_pool = std::make_shared<Pool>(static_cast<size_t>(threads - 1));
    g_num_threads = g_pool->workers();
  }
  return g_pool;
}

}  // namespace

int num_threads() {
  const std::lock_guard lock(g_pool_mutex);
  if (g_num_threads == 0) g_num_threads = available_processors();
  return g_num_threads;
}

void set_num_threads(int count) {
  if (count < 1) throw_error(ErrorCode::kUsage, "threads: expected at least 1, found {}", count);
  check(!t_inside_parallel_for, "set_num_threads called inside a parallel_for");
  std::shared_ptr<Pool> old;
  const std::lock_guard lock(g_pool_mutex);
  g_num_threads = count;
  old.swap(g_pool);
}

int start_threads() { return num_threads() == 1 ? 1 : pool()->workers(); }

void parallel_for_workers(int64_t size, int64_t grain,
                          const std::function<void(int64_t, int64_t, int)>& body) {
  check(size >= 0 && grain >= 1, "parallel_for: size >= 0 and grain >= 1");
  if (size == 0) return;
  if (t_inside_parallel_for) {
    for (int64_t begin = 0; begin < size; begin += grain) {
      throw_if_interrupted();
      body(begin, std::min(size, begin + grain), 0);
    }
    return;
  }
  Job job{size, grain, &body};
  if (size <= grain || num_threads() == 1) {
    job.run(0);
  } else {
    pool()->run(job);
  }
  if (job.error) std::rethrow_exception(job.error);
}

void parallel_for(int64_t size, int64_t grain, const std::function<void(int64_t, int64_t)>& body) {
  parallel_for_workers(size, grain, [&](int64_t begin, int64_t end, int) { body(begin, end); });
}

}  // namespace vggtcd
