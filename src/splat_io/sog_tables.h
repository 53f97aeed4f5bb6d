// SPDX-License-Identifier: BSD-3-Clause
// Tables that stand for many values, which a SOG scene stores instead of numbers. Sums and ties
// have one order, so that the same values give the same tables.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/monitor.h"

namespace retint {

inline constexpr size_t kTableSize = 256;

// At most 256 ascending numbers for `values`: those themselves where there are so few, else the
// centers of a one-dimensional k-means (Lloyd 1982), least squares.
std::vector<float> FitTable(std::vector<float> values);

// The same where most values are of a table that is there: those keep their entries, and the rest
// gets what is free of it. A new table where that would put a value further from its entry than
// `most`. `table` has 256 entries in any order; so has the result.
std::vector<float> RefitTable(std::span<const float> table, const std::vector<float>& values,
                              float most);

// Index of the entry that is nearest to `value`, of equally near ones the first of the least.
class TableLookup {
 public:
  explicit TableLookup(std::span<const float> table);
  uint8_t Find(float value) const;

 private:
  std::vector<float> sorted_;
  std::vector<uint8_t> index_;
};

// Vectors of `width` numbers that stand for many.
struct VectorPalette {
  size_t width = 0;
  std::vector<float> entries;    // [count, width]
  std::vector<uint32_t> labels;  // of each vector
  size_t Count() const { return width == 0 ? 0 : entries.size() / width; }
};

// At most `most` entries for `vectors`, [N, width], `stride` floats apart: those of `known`
// ([count, width], it may be empty) that vectors equal stay where they are; the other vectors share
// what is left. Where there are more of them than that, the set with the largest sum of squares is
// split at its mean, along its widest axis, until there are as many sets as entries, whose means
// they are. Checks for cancellation.
VectorPalette FitPalette(const float* vectors, size_t count, size_t width, size_t stride,
                         std::span<const float> known, size_t most, Monitor& monitor);

}  // namespace retint
