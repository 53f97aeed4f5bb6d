// SPDX-License-Identifier: BSD-3-Clause
// Parallel loops over many Gaussians or pictures of a file. Faults are those of a plain loop: of
// several, the first in the file is thrown.
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

// Calls body(i) for every i of `order`, a permutation of [0, size), each as a task of its own.
// Tasks begin in that order.
template <typename Body>
void ForEachTask(const std::vector<size_t>& order, const Body& body) {
  std::vector<std::exception_ptr> faults(order.size());
  // ParallelTasks() has an order of its own, so each task takes the next index of ours.
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
// The indices of `tasks`, the largest first. Otherwise a large task could begin last, and all would
// wait for it.
template <typename Tasks>
std::vector<size_t> LargestFirst(const Tasks& tasks) {
  std::vector<size_t> order(tasks.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return tasks[a].size() > tasks[b].size(); });
  return order;
}

// A piece fits a core's cache. All cores share the pieces between two reports.
inline constexpr size_t kRowsAPiece = 512, kPiecesAReport = 8;

// Calls body(begin, end) for pieces of [0, count). Calls report(done) between some of them and at
// the end, on this thread.
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
