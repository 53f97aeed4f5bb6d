// SPDX-License-Identifier: BSD-3-Clause
#include "selection/graph_hierarchy.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

#include "base/parallel.h"

namespace retint {
namespace {

constexpr double kDamping = 2.0 / 3;  // of Jacobi; eigenvalues of D^-1 A lie in (0, 2]
constexpr float kStrong = 0.5f;       // of a node's largest weight
constexpr double kDominant = 0.8;  // if trust makes this part of the diagonal, the node stays alone
constexpr size_t kFewNodes = 64;
constexpr size_t kMostLevels = 20;
constexpr double kLeastGain = 0.8;  // a coarser graph has at most this part of the nodes
constexpr int kCoarsestSteps = 8;   // of Jacobi, on the coarsest graph
constexpr int64_t kGrain = 4096;

// body(i) for every i below `count`.
template <typename Body>
void Each(size_t count, const Body& body) {
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto i = size_t(first); i < size_t(last); ++i) body(i);
  });
}

}  // namespace

GraphMatrix::GraphMatrix(std::span<const size_t> begins, std::span<const int> others,
                         std::span<const float> weights, std::vector<double> trusts)
    : begin(begins),
      other(others),
      weight(weights),
      trust(std::move(trusts)),
      diagonal(trust.size()) {
  Each(size(), [&](size_t i) {
    diagonal[i] = trust[i];
    for (size_t e = begin[i]; e < begin[i + 1]; ++e) diagonal[i] += double(weight[e]);
  });
}

GraphHierarchy::GraphHierarchy(GraphMatrix finest) {
  levels_.reserve(kMostLevels);  // no reallocation: each level points into the arrays of another.
  levels_.emplace_back().matrix = std::move(finest);
  while (levels_.size() < kMostLevels && levels_.back().matrix.size() > kFewNodes &&
         Aggregate(&levels_.back())) {
    levels_.push_back(Coarsen(levels_.back()));
    Level& coarse = levels_.back();  // its arrays moved with it, their memory did not
    coarse.matrix = {coarse.begin, coarse.other, coarse.weight, std::move(coarse.matrix.trust)};
  }
}

// Greedy: if no strong neighbor of a node is taken, the node and all of them become one part.
// Remaining nodes join the part of their strongest neighbor that has one. Nodes with a dominant
// trust join none. False if the coarser graph would not be much smaller.
bool GraphHierarchy::Aggregate(Level* level) {
  const GraphMatrix& matrix = level->matrix;
  const size_t count = matrix.size();
  std::vector<float> strong(count);  // least weight of a strong edge; 0: the node stays alone
  Each(count, [&](size_t i) {
    float largest = 0;
    for (size_t e = matrix.begin[i]; e < matrix.begin[i + 1]; ++e) {
      largest = std::max(largest, matrix.weight[e]);
    }
    strong[i] = matrix.trust[i] > kDominant * matrix.diagonal[i] ? 0 : kStrong * largest;
  });
  std::vector<int>& part_of = level->part_of;
  part_of.assign(count, -1);
  int parts = 0;
  const auto for_strong = [&](size_t i, const auto& visit) {
    for (size_t e = matrix.begin[i]; e < matrix.begin[i + 1]; ++e) {
      const auto other = size_t(matrix.other[e]);
      if (matrix.weight[e] >= strong[i] && strong[other] > 0 && !visit(other)) return false;
    }
    return true;
  };
  for (size_t i = 0; i < count; ++i) {
    if (strong[i] == 0 || part_of[i] >= 0) continue;
    if (!for_strong(i, [&](size_t other) { return part_of[other] < 0; })) continue;
    part_of[i] = parts;
    for_strong(i, [&](size_t other) { return part_of[other] = parts, true; });
    ++parts;
  }
  const std::vector<int> first = part_of;
  for (size_t i = 0; i < count; ++i) {
    if (strong[i] == 0 || part_of[i] >= 0) continue;
    float largest = 0;
    for (size_t e = matrix.begin[i]; e < matrix.begin[i + 1]; ++e) {
      const int part = first[size_t(matrix.other[e])];
      if (part >= 0 && matrix.weight[e] > largest) largest = matrix.weight[e], part_of[i] = part;
    }
    if (part_of[i] < 0) part_of[i] = parts++;
  }
  if (parts == 0 || double(parts) > kLeastGain * double(count)) {
    part_of.clear();
    return false;
  }
  level->members_begin.assign(size_t(parts) + 1, 0);
  for (const int part : part_of) {
    if (part >= 0) ++level->members_begin[size_t(part) + 1];
  }
  std::partial_sum(level->members_begin.begin(), level->members_begin.end(),
                   level->members_begin.begin());
  level->members.resize(level->members_begin.back());
  std::vector<size_t> next(level->members_begin.begin(), level->members_begin.end() - 1);
  for (size_t i = 0; i < count; ++i) {
    if (part_of[i] >= 0) level->members[next[size_t(part_of[i])]++] = int(i);
  }
  return true;
}

// P^T A P, where P gives every member the value of its part.
GraphHierarchy::Level GraphHierarchy::Coarsen(const Level& fine) {
  const size_t parts = fine.members_begin.size() - 1;
  struct Row {
    std::vector<int> other;
    std::vector<float> weight;
    double trust = 0;
  };
  std::vector<Row> rows(parts);
  constexpr int64_t kParts = 1024;
  ParallelRanges(int64_t(parts), kParts, [&](int64_t first, int64_t last) {
    std::vector<double> sums(parts, 0.0);  // by the other part; all 0 between two rows
    for (auto part = size_t(first); part < size_t(last); ++part) {
      Row& row = rows[part];
      for (size_t m = fine.members_begin[part]; m < fine.members_begin[part + 1]; ++m) {
        const auto i = size_t(fine.members[m]);
        row.trust += fine.matrix.trust[i];
        for (size_t e = fine.matrix.begin[i]; e < fine.matrix.begin[i + 1]; ++e) {
          const int to = fine.part_of[size_t(fine.matrix.other[e])];
          const auto weight = double(fine.matrix.weight[e]);
          if (to == int(part) || weight == 0) continue;
          if (to < 0) {  // a node outside all parts keeps its value
            row.trust += weight;
            continue;
          }
          if (sums[size_t(to)] == 0) row.other.push_back(to);
          sums[size_t(to)] += weight;
        }
      }
      std::sort(row.other.begin(), row.other.end());
      for (const int to : row.other) {
        row.weight.push_back(float(std::exchange(sums[size_t(to)], 0)));
      }
    }
  });
  Level coarse;
  std::vector<double>& trust = coarse.matrix.trust;
  trust.resize(parts);
  coarse.begin.assign(parts + 1, 0);
  for (size_t part = 0; part < parts; ++part) {
    trust[part] = rows[part].trust;
    coarse.begin[part + 1] = coarse.begin[part] + rows[part].other.size();
  }
  coarse.other.resize(coarse.begin.back());
  coarse.weight.resize(coarse.begin.back());
  Each(parts, [&](size_t part) {
    std::copy(rows[part].other.begin(), rows[part].other.end(),
              coarse.other.begin() + std::ptrdiff_t(coarse.begin[part]));
    std::copy(rows[part].weight.begin(), rows[part].weight.end(),
              coarse.weight.begin() + std::ptrdiff_t(coarse.begin[part]));
  });
  return coarse;
}

void GraphHierarchy::Cycle(size_t at, const std::vector<double>& r, std::vector<double>* x) {
  Level& level = levels_[at];
  const GraphMatrix& matrix = level.matrix;
  const size_t count = matrix.size();
  level.rest.resize(count);
  x->resize(count);
  Each(count, [&](size_t i) { (*x)[i] = kDamping * r[i] / matrix.diagonal[i]; });
  const auto relax = [&] {
    Each(count, [&](size_t i) { level.rest[i] = r[i] - matrix.Row(i, *x); });
    Each(count, [&](size_t i) { (*x)[i] += kDamping * level.rest[i] / matrix.diagonal[i]; });
  };
  if (at + 1 == levels_.size()) {
    for (int step = 1; step < kCoarsestSteps; ++step) relax();
    return;
  }
  Each(count, [&](size_t i) { level.rest[i] = r[i] - matrix.Row(i, *x); });
  std::vector<double> coarse_rest(level.members_begin.size() - 1);
  Each(coarse_rest.size(), [&](size_t part) {
    double sum = 0;
    for (size_t m = level.members_begin[part]; m < level.members_begin[part + 1]; ++m) {
      sum += level.rest[size_t(level.members[m])];
    }
    coarse_rest[part] = sum;
  });
  Cycle(at + 1, coarse_rest, &level.corrected);
  Each(count, [&](size_t i) {
    if (level.part_of[i] >= 0) (*x)[i] += level.corrected[size_t(level.part_of[i])];
  });
  relax();
}

}  // namespace retint
