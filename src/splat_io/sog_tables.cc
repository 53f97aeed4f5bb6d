// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/sog_tables.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <queue>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace retint {
namespace {

constexpr int kRounds = 40;  // of Lloyd's algorithm; more would gain less than a percent

void SortDistinct(std::vector<float>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

// Half of the centers are quantiles of the values. The others are spread evenly, so that a few far
// values get some too.
std::vector<double> FirstCenters(const std::vector<float>& sorted, size_t count) {
  std::vector<double> centers;
  const double low = sorted.front(), high = sorted.back();
  for (size_t i = 0; i < count; ++i) {
    const double t = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const auto at = static_cast<size_t>(t * static_cast<double>(sorted.size()));
    centers.push_back(i % 2 == 0 ? double{sorted[at]} : low + (high - low) * t);
  }
  std::sort(centers.begin(), centers.end());
  return centers;
}

std::vector<float> KMeans(const std::vector<float>& sorted, size_t count) {
  std::vector<double> sums(sorted.size() + 1);
  for (size_t i = 0; i < sorted.size(); ++i) sums[i + 1] = sums[i] + double{sorted[i]};
  std::vector<double> centers = FirstCenters(sorted, count);
  for (int round = 0; round < kRounds; ++round) {
    size_t begin = 0;
    for (size_t c = 0; c < count; ++c) {
      size_t end = sorted.size();
      if (c + 1 < count) {
        const auto middle = static_cast<float>(0.5 * (centers[c] + centers[c + 1]));
        end = static_cast<size_t>(std::upper_bound(sorted.begin(), sorted.end(), middle) -
                                  sorted.begin());
      }
      end = std::max(begin, end);
      if (end > begin) centers[c] = (sums[end] - sums[begin]) / static_cast<double>(end - begin);
      begin = end;
    }
    std::sort(centers.begin(), centers.end());
  }
  return {centers.begin(), centers.end()};
}

std::string_view BytesOf(const float* vector, size_t width) {
  return {reinterpret_cast<const char*>(vector), width * sizeof(float)};
}

// A set of vectors: a range in an order.
struct Cell {
  size_t begin = 0, end = 0, axis = 0;
  double squares = 0;
  bool operator<(const Cell& other) const {
    return squares != other.squares ? squares < other.squares : begin > other.begin;
  }
};

class Splitter {
 public:
  Splitter(const float* vectors, size_t width, size_t stride, std::vector<uint32_t> order)
      : vectors_(vectors), width_(width), stride_(stride), order_(std::move(order)) {}

  // Splits the order into at most `most` sets.
  std::vector<Cell> Split(size_t most, Monitor& monitor) {
    std::priority_queue<Cell> open;
    open.push(Measured(0, order_.size()));
    for (size_t sets = 1; sets < most && open.top().squares > 0; ++sets) {
      if (sets % 1024 == 0) monitor.ThrowIfCancelled();
      const Cell cell = open.top();
      open.pop();
      const double mean = Mean(cell, cell.axis);
      const auto first = order_.begin() + static_cast<ptrdiff_t>(cell.begin);
      const auto last = order_.begin() + static_cast<ptrdiff_t>(cell.end);
      const auto middle = std::stable_partition(
          first, last, [&](uint32_t i) { return double{At(i, cell.axis)} < mean; });
      // If the mean rounds to one end, one side would be empty.
      if (middle == first || middle == last) {
        open.push({cell.begin, cell.end, cell.axis, 0});
        continue;
      }
      const auto split = static_cast<size_t>(middle - order_.begin());
      open.push(Measured(cell.begin, split));
      open.push(Measured(split, cell.end));
    }
    std::vector<Cell> cells;
    for (; !open.empty(); open.pop()) cells.push_back(open.top());
    std::sort(cells.begin(), cells.end(),
              [](const Cell& a, const Cell& b) { return a.begin < b.begin; });
    return cells;
  }

  double Mean(const Cell& cell, size_t axis) const {
    double sum = 0;
    for (size_t i = cell.begin; i < cell.end; ++i) sum += double{At(order_[i], axis)};
    return sum / static_cast<double>(cell.end - cell.begin);
  }
  const std::vector<uint32_t>& order() const { return order_; }

 private:
  float At(uint32_t vector, size_t axis) const { return vectors_[vector * stride_ + axis]; }

  Cell Measured(size_t begin, size_t end) const {
    Cell cell{begin, end, 0, 0};
    if (end - begin < 2) return cell;
    std::vector<double> sums(width_), squares(width_);
    for (size_t i = begin; i < end; ++i) {
      const float* vector = vectors_ + order_[i] * stride_;
      for (size_t j = 0; j < width_; ++j) {
        sums[j] += double{vector[j]};
        squares[j] += double{vector[j]} * double{vector[j]};
      }
    }
    double widest = 0;
    for (size_t j = 0; j < width_; ++j) {
      const double spread =
          std::max(0.0, squares[j] - sums[j] * sums[j] / static_cast<double>(end - begin));
      cell.squares += spread;
      if (spread > widest) widest = spread, cell.axis = j;
    }
    return cell;
  }

  const float* vectors_;
  size_t width_, stride_;
  std::vector<uint32_t> order_;
};

constexpr uint32_t kKnown = UINT32_MAX;

// Vectors by their bytes: known ones, and kinds of other ones.
struct Kinds {
  std::vector<uint32_t> label;  // of each vector: its place among the known ones, else 0
  std::vector<uint32_t> of;     // of each vector: its kind, or kKnown
  std::vector<uint32_t> first;  // of each kind: its first vector
  std::vector<bool> used;       // of each known vector

  Kinds(const float* vectors, size_t count, size_t width, size_t stride,
        const std::vector<float>& known)
      : label(count), of(count, kKnown), used(known.size() / width) {
    std::unordered_map<std::string_view, uint32_t> by_bytes, fresh;
    for (size_t i = 0; i < used.size(); ++i) {
      by_bytes.emplace(BytesOf(known.data() + i * width, width), static_cast<uint32_t>(i));
    }
    for (size_t g = 0; g < count; ++g) {
      const std::string_view bytes = BytesOf(vectors + g * stride, width);
      if (const auto found = by_bytes.find(bytes); found != by_bytes.end()) {
        label[g] = found->second;
        used[found->second] = true;
        continue;
      }
      const auto [entry, is_new] = fresh.emplace(bytes, static_cast<uint32_t>(first.size()));
      if (is_new) first.push_back(static_cast<uint32_t>(g));
      of[g] = entry->second;
    }
  }
};

}  // namespace

std::vector<float> FitTable(std::vector<float> values) {
  std::sort(values.begin(), values.end());
  std::vector<float> distinct = values;
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  return distinct.size() <= kTableSize ? distinct : KMeans(values, kTableSize);
}

std::vector<float> RefitTable(std::span<const float> table, const std::vector<float>& values,
                              float most) {
  std::vector<float> old(table.begin(), table.end());
  SortDistinct(old);
  std::vector<float> fresh;
  std::vector<bool> used(old.size(), false);
  for (const float value : values) {
    const auto found = std::lower_bound(old.begin(), old.end(), value);
    if (found != old.end() && *found == value) {
      used[static_cast<size_t>(found - old.begin())] = true;
    } else {
      fresh.push_back(value);
    }
  }
  std::vector<float> result(table.begin(), table.end());
  if (fresh.empty()) return result;
  // Free entries: no value equals them, or they are in the table twice.
  std::vector<size_t> free;
  std::vector<float> taken;
  for (size_t i = 0; i < result.size(); ++i) {
    const auto at =
        static_cast<size_t>(std::lower_bound(old.begin(), old.end(), result[i]) - old.begin());
    const bool twice = std::find(taken.begin(), taken.end(), result[i]) != taken.end();
    if (used[at] && !twice) {
      taken.push_back(result[i]);
    } else {
      free.push_back(i);
    }
  }
  std::sort(fresh.begin(), fresh.end());
  if (!free.empty()) {
    std::vector<float> distinct = fresh;
    SortDistinct(distinct);
    const std::vector<float> centers =
        distinct.size() <= free.size() ? distinct : KMeans(fresh, free.size());
    for (size_t i = 0; i < centers.size(); ++i) result[free[i]] = centers[i];
  }
  const TableLookup lookup(result);
  for (const float value : fresh) {
    if (std::abs(result[lookup.Find(value)] - value) <= most) continue;
    result = FitTable(values);
    break;
  }
  result.resize(kTableSize, result.back());
  return result;
}

TableLookup::TableLookup(std::span<const float> table) {
  std::vector<size_t> order(table.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return table[a] < table[b]; });
  for (const size_t i : order) {
    if (!sorted_.empty() && sorted_.back() == table[i]) continue;
    sorted_.push_back(table[i]);
    index_.push_back(static_cast<uint8_t>(i));
  }
}

uint8_t TableLookup::Find(float value) const {
  const auto above = std::lower_bound(sorted_.begin(), sorted_.end(), value);
  auto at = static_cast<size_t>(above - sorted_.begin());
  if (at == sorted_.size() || (at > 0 && value - sorted_[at - 1] <= sorted_[at] - value)) --at;
  return index_[at];
}

VectorPalette FitPalette(const float* vectors, size_t count, size_t width, size_t stride,
                         std::span<const float> known, size_t most, Monitor& monitor) {
  VectorPalette palette;
  palette.width = width;
  const size_t num_known = std::min(known.size() / width, most);
  palette.entries.assign(known.begin(), known.begin() + static_cast<ptrdiff_t>(num_known * width));
  Kinds kinds(vectors, count, width, stride, palette.entries);
  std::vector<uint32_t> slots;
  for (size_t i = 0; i < most && slots.size() < kinds.first.size(); ++i) {
    if (i >= num_known || !kinds.used[i]) slots.push_back(static_cast<uint32_t>(i));
  }
  palette.labels = std::move(kinds.label);
  if (kinds.first.empty()) return palette;
  if (slots.empty()) {  // all entries equal vectors: all are made anew
    return FitPalette(vectors, count, width, stride, {}, most, monitor);
  }
  if (slots.back() >= num_known) palette.entries.resize((slots.back() + size_t{1}) * width);
  std::unordered_map<uint32_t, uint32_t> slot_of;  // by a kind's first vector
  Splitter splitter(vectors, width, stride, kinds.first);
  const std::vector<Cell> cells = splitter.Split(slots.size(), monitor);
  for (size_t c = 0; c < cells.size(); ++c) {
    for (size_t j = 0; j < width; ++j) {
      palette.entries[slots[c] * width + j] = static_cast<float>(splitter.Mean(cells[c], j));
    }
    for (size_t i = cells[c].begin; i < cells[c].end; ++i) {
      slot_of[splitter.order()[i]] = slots[c];
    }
  }
  for (size_t g = 0; g < count; ++g) {
    if (kinds.of[g] != kKnown) palette.labels[g] = slot_of.at(kinds.first[kinds.of[g]]);
  }
  return palette;
}

}  // namespace retint
