// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/row_parts.h"

#include <algorithm>

namespace retint {

std::shared_ptr<const RowsByPart> RowParts::Of(size_t view, const ViewGeometry& region,
                                               const int32_t* slots) {
  if (of_views_[view]) return of_views_[view];
  const size_t rows = size_t(region.num_rows()), parts = begins_.size() - 1;
  const int32_t* const gaussians = region.rows();
  const auto part_of = [&](int32_t slot) {
    return size_t(std::upper_bound(begins_.begin(), begins_.end(), slot) - begins_.begin()) - 1;
  };
  auto result = std::make_shared<RowsByPart>();
  result->begin.assign(parts + 1, 0);
  for (size_t r = 0; r < rows; ++r) {
    if (slots[r] >= 0) ++result->begin[part_of(slots[r]) + 1];
  }
  for (size_t p = 0; p < parts; ++p) result->begin[p + 1] += result->begin[p];
  std::vector<size_t> next = result->begin;
  for (auto* list : {&result->row, &result->gaussian, &result->slot}) {
    list->resize(result->begin.back());
  }
  for (size_t r = 0; r < rows; ++r) {
    if (slots[r] < 0) continue;
    const size_t at = next[part_of(slots[r])]++;
    result->row[at] = int32_t(r);
    result->gaussian[at] = gaussians[r];
    result->slot[at] = slots[r];
  }
  return of_views_[view] = std::move(result);
}

}  // namespace retint
