// SPDX-License-Identifier: BSD-3-Clause
// Tables of values: SOG scenes store indices into them. Sums and ties have a fixed order, so that
// equal values give equal tables.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/monitor.h"

namespace retint {

inline constexpr size_t kTableSize = 256;

// At most 256 ascending numbers for `values`: the distinct values if there are so few, otherwise
// the centers of a one-dimensional k-means (Lloyd 1982).
std::vector<float> FitTable(std::vector<float> values);

// Adapts a table to changed values. Values in `table` keep their entries, the others share the
// unused entries. If a value would be farther than `most` from its entry, all entries are made
// anew. `table` has 256 entries in any order, as does the result.
std::vector<float> RefitTable(std::span<const float> table, const std::vector<float>& values,
                              float most);

// Index of the nearest entry; of two equally near ones the smaller, of equal ones the first.
class TableLookup {
 public:
  explicit TableLookup(std::span<const float> table);
  uint8_t Find(float value) const;

 private:
  std::vector<float> sorted_;
  std::vector<uint8_t> index_;
};

// Vectors of `width` numbers. Each label selects the entry for one of many vectors.
struct VectorPalette {
  size_t width = 0;
  std::vector<float> entries;    // [count, width]
  std::vector<uint32_t> labels;  // of each vector
  size_t Count() const { return width == 0 ? 0 : entries.size() / width; }
};

// At most `most` entries for `vectors`, [N, width], `stride` floats apart. Entries of `known`
// ([count, width], may be empty) keep their places if a vector equals them; other vectors share the
// remaining places. If they are too few, vectors are grouped. The group with the largest sum of
// squares is split at its mean, along its widest axis, until each place has a group. It gets the
// group's mean. Cancellable.
VectorPalette FitPalette(const float* vectors, size_t count, size_t width, size_t stride,
                         std::span<const float> known, size_t most, Monitor& monitor);

}  // namespace retint
