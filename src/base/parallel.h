// SPDX-License-Identifier: BSD-3-Clause
// Loops over threads whose results do not depend on how many there are.
#pragma once

#include <cstdint>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#if defined(__SANITIZE_THREAD__)
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
#endif

namespace retint {

// oneTBB is not built for the thread sanitizer, which thus cannot see that a loop's pieces come
// after what precedes the loop and before what follows it: this tells it. Pieces stay unordered
// among themselves, so that races between them are found.
class LoopOrder {
 public:
#if defined(__SANITIZE_THREAD__)
  LoopOrder() { __tsan_release(&begun_); }
  ~LoopOrder() { __tsan_acquire(&done_); }
  void BeginPiece() { __tsan_acquire(&begun_); }
  void EndPiece() { __tsan_release(&done_); }

 private:
  char begun_ = 0, done_ = 0;
#else
  LoopOrder() {}
  void BeginPiece() {}
  void EndPiece() {}
#endif
};

// body(begin, end) over pieces of [0, count) of about `grain`. Throws what a piece throws.
template <typename Body>
void ParallelRanges(int64_t count, int64_t grain, const Body& body) {
  if (count <= 0) return;
  struct Piece {
    LoopOrder& order;
    explicit Piece(LoopOrder& of) : order(of) { order.BeginPiece(); }
    ~Piece() { order.EndPiece(); }
  };
  LoopOrder order;
  tbb::parallel_for(tbb::blocked_range<int64_t>(0, count, grain),
                    [&](const tbb::blocked_range<int64_t>& range) {
                      const Piece piece(order);
                      body(range.begin(), range.end());
                    });
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
