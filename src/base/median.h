// SPDX-License-Identifier: BSD-3-Clause
// Order statistics. No value may be NaN.
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace retint {

// The value at or below which a share of `values` lies, of which there is at least one, without
// interpolation: that at share times the last index, rounded down. Reorders them.
template <typename T>
T Quantile(std::vector<T>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The middle one of the sorted values, of an even number the upper of the two; `if_empty` of none.
template <typename T>
T Median(std::vector<T> values, std::type_identity_t<T> if_empty = {}) {
  if (values.empty()) return if_empty;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace retint
