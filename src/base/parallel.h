// SPDX-License-Identifier: BSD-3-Clause
// Loops over threads whose results do not depend on how many there are, and work that gives way.
#pragma once

#include <sys/resource.h>

#include <cstdint>
#include <vector>

#if defined(__SANITIZE_THREAD__)
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#endif

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace retint {

// body(begin, end) over pieces of [0, count) of about `grain`. Throws what a piece throws.
#if defined(__SANITIZE_THREAD__)
// oneTBB is not built for the thread sanitizer, which would take every hand-over of its own for a
// race and could not check a loop's pieces against each other: here, two plain threads.
template <typename Body>
void ParallelRanges(int64_t count, int64_t grain, const Body& body) {
  std::atomic<int64_t> next = 0;
  std::exception_ptr error;
  std::mutex mutex;
  const auto work = [&] {
    try {
      for (int64_t i; (i = next.fetch_add(grain)) < count;) body(i, std::min(i + grain, count));
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
template <typename Body>
void ParallelRanges(int64_t count, int64_t grain, const Body& body) {
  if (count <= 0) return;
  tbb::parallel_for(tbb::blocked_range<int64_t>(0, count, grain),
                    [&](const tbb::blocked_range<int64_t>& r) { body(r.begin(), r.end()); });
}
#endif

// `work` on this thread, whose own it is from now on, and its loops wherever nobody else wants a
// core: for what goes on behind a window that someone works in.
template <typename Work>
void RunInBackground(const Work& work) {
  setpriority(PRIO_PROCESS, 0, 10);  // on Linux of the calling thread
#if defined(__SANITIZE_THREAD__)
  work();
#else
  tbb::task_arena arena(tbb::task_arena::automatic, 1, tbb::task_arena::priority::low);
  arena.execute(work);
#endif
}

// body(i) for i in [0, count), each a task of its own.
template <typename Body>
void ParallelTasks(int64_t count, const Body& body) {
  ParallelRanges(count, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) body(i);
  });
}

// Sum over fixed pieces of [0, count), added in their order.
template <typename Body>
double OrderedSum(int64_t count, int64_t piece, const Body& body) {
  const int64_t pieces = (count + piece - 1) / piece;
  std::vector<double> partial(size_t(pieces), 0.0);
  ParallelTasks(pieces, [&](int64_t i) {
    const int64_t begin = i * piece;
    partial[size_t(i)] = body(begin, begin + piece < count ? begin + piece : count);
  });
  double sum = 0;
  for (const double value : partial) sum += value;
  return sum;
}

}  // namespace retint
