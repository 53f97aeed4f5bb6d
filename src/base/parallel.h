// SPDX-License-Identifier: BSD-3-Clause
// Loops over threads whose results do not depend on how many there are, and work that gives way.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace retint {

// The core of ParallelRanges(), for oneTBB to be compiled once: run(body, begin, end) over pieces
// of [0, count) of about `grain`.
void ParallelPieces(int64_t count, int64_t grain,
                    void (*run)(const void* body, int64_t begin, int64_t end), const void* body);
// The same of RunInBackground().
void RunInBackground(void (*run)(const void* work), const void* work);

// body(begin, end) over pieces of [0, count) of about `grain`. Throws the exception of a piece.
template <typename Body>
void ParallelRanges(int64_t count, int64_t grain, const Body& body) {
  const auto run = [](const void* one, int64_t begin, int64_t end) {
    (*static_cast<const Body*>(one))(begin, end);
  };
  ParallelPieces(count, grain, run, &body);
}

// `work` on this thread, whose own it is from now on, and its loops wherever nobody else wants a
// core: for work behind a window that someone works in.
template <typename Work>
void RunInBackground(const Work& work) {
  RunInBackground([](const void* one) { (*static_cast<const Work*>(one))(); }, &work);
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
