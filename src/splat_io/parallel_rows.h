// SPDX-License-Identifier: BSD-3-Clause
// Work on many Gaussians of a file, or on several of its pictures, on all cores, with the faults of
// a plain loop: of several that are found, the first in the file is thrown.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <numeric>
#include <vector>

#include "base/parallel.h"

namespace retint {

// body(i) for every i in `order`, which has the numbers below its size, begun in that order, each a
// task of its own.
template <typename Body>
void ForEachTask(const std::vector<size_t>& order, const Body& body) {
  std::vector<std::exception_ptr> faults(order.size());
  // The threads share tasks out in an order of their own: each takes the next one in ours.
  std::atomic<size_t> next = 0;
  ParallelTasks(static_cast<int64_t>(order.size()), [&](int64_t) {
    const size_t i = order[next.fetch_add(1)];
    try {
      body(i);
    } catch (...) {
      faults[i] = std::current_exception();
    }
  });
  for (const std::exception_ptr& fault : faults) {
    if (fault) std::rethrow_exception(fault);
  }
}
// The same for i in [0, count).
template <typename Body>
void ForEachTask(size_t count, const Body& body) {
  std::vector<size_t> order(count);
  std::iota(order.begin(), order.end(), size_t{0});
  ForEachTask(order, body);
}
// The numbers of `tasks`, those with the most work first: a large one that begins last is waited
// for.
template <typename Tasks>
std::vector<size_t> LargestFirst(const Tasks& tasks) {
  std::vector<size_t> order(tasks.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return tasks[a].size() > tasks[b].size(); });
  return order;
}

// A piece stays in a core's cache; the pieces between two reports are shared by the cores.
inline constexpr size_t kRowsAPiece = 512, kPiecesAReport = 8;

// body(begin, end) for pieces of [0, count); report(done) between some of them and at the end, on
// this thread.
template <typename Report, typename Body>
void ForRows(size_t count, const Report& report, const Body& body,
             size_t rows_a_piece = kRowsAPiece, size_t pieces_a_report = kPiecesAReport) {
  const size_t batch = pieces_a_report * rows_a_piece;
  for (size_t first = 0; first < count; first += batch) {
    report(first);
    const size_t rows = std::min(batch, count - first);
    ForEachTask((rows + rows_a_piece - 1) / rows_a_piece, [&](size_t i) {
      const size_t begin = first + i * rows_a_piece;
      body(begin, std::min(begin + rows_a_piece, first + rows));
    });
  }
  report(count);
}

}  // namespace retint
