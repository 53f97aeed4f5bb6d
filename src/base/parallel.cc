// SPDX-License-Identifier: BSD-3-Clause
#include "base/parallel.h"

#include <sys/resource.h>

#if defined(__SANITIZE_THREAD__)
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#else
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace retint {

#if defined(__SANITIZE_THREAD__)

// oneTBB is not built for the thread sanitizer, which would report races inside it and could not
// check a loop's pieces against each other. So this uses two plain threads.
void ParallelPieces(int64_t count, int64_t grain,
                    void (*run)(const void* body, int64_t begin, int64_t end), const void* body) {
  std::atomic<int64_t> next = 0;
  std::exception_ptr error;
  std::mutex mutex;
  const auto work = [&] {
    try {
      for (int64_t i; (i = next.fetch_add(grain)) < count;) {
        run(body, i, std::min(i + grain, count));
      }
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      error = std::current_exception();
    }
  };
  if (count > grain) {
    std::thread other(work);
    work();
    other.join();
  } else {
    work();
  }
  if (error) std::rethrow_exception(error);
}

#else

void ParallelPieces(int64_t count, int64_t grain,
                    void (*run)(const void* body, int64_t begin, int64_t end), const void* body) {
  if (count <= 0) return;
  tbb::parallel_for(tbb::blocked_range<int64_t>(0, count, grain),
                    [&](const tbb::blocked_range<int64_t>& r) { run(body, r.begin(), r.end()); });
}

#endif

void RunInBackground(void (*run)(const void* work), const void* work) {
  setpriority(PRIO_PROCESS, 0, 10);  // on Linux of the calling thread
#if defined(__SANITIZE_THREAD__)
  run(work);
#else
  tbb::task_arena arena(tbb::task_arena::automatic, 1, tbb::task_arena::priority::low);
  arena.execute([&] { run(work); });
#endif
}

}  // namespace retint
