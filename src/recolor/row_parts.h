// SPDX-License-Identifier: BSD-3-Clause
// Parts of the active Gaussians, in which a ViewSum goes from process to process. Internal to
// recolor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "kernels/blend_ops.h"

namespace retint {

// The rows of a view that have a slot, by part; host memory.
struct RowsByPart {
  std::vector<int32_t> row, gaussian, slot;
  std::vector<size_t> begin;  // [parts + 1] into these
};

class RowParts {
 public:
  RowParts() = default;
  // `begins`: the first active Gaussian of each part, and the end.
  RowParts(std::vector<int32_t> begins, size_t num_views)
      : begins_(std::move(begins)), of_views_(num_views) {}

  std::span<const int32_t> begins() const { return begins_; }
  // Found once a view; `slots` [rows] in host memory, negative for rows without a slot.
  std::shared_ptr<const RowsByPart> Of(size_t view, const ViewGeometry& region,
                                       const int32_t* slots);

 private:
  std::vector<int32_t> begins_;
  std::vector<std::shared_ptr<const RowsByPart>> of_views_;  // null: not asked for yet
};

}  // namespace retint
