// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace retint {

// The middle one of the sorted values, of an even number the upper of the two; `if_empty` of none.
// No value may be NaN.
inline double Median(std::vector<double> values, double if_empty = 0) {
  if (values.empty()) return if_empty;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace retint
