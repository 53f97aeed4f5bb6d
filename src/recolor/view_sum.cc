// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/view_sum.h"

#include <algorithm>
#include <span>

#include "base/parallel.h"

namespace retint {

void ViewSum::AddToBlocks(const float* center, const int32_t* gaussians, const int32_t* slots,
                          int64_t count, const float* values, const float* colors, float* sum) {
  ShOps& sh = views_.backend().sh();
  if (kind_ == Kind::kGradient) {
    sh.EvalShTranspose(views_.model(), {.rows = gaussians,
                                        .slots = slots,
                                        .count = count,
                                        .color_gradients = values,
                                        .colors = colors,
                                        .center = {center[0], center[1], center[2]},
                                        .gradient = sum});
  } else {
    sh.AccumulateBlocks(views_.model(), {.rows = gaussians,
                                         .slots = slots,
                                         .count = count,
                                         .weights = values,
                                         .center = {center[0], center[1], center[2]},
                                         .blocks = sum});
  }
}

void ViewSum::Add(size_t view, const RegionView& region, const float* values, const float* colors,
                  Buffer<float>& sum) {
  const float* const center = region.region->camera().center;
  if (!views_.reducer().AddsInOrder()) {
    AddToBlocks(center, region.region->rows(), region.slots.data(), region.region->num_rows(),
                values, colors, sum.data());
    return;
  }
  constexpr int64_t kGrain = 4096;
  Kept& kept = kept_.emplace_back();
  std::copy_n(center, 3, kept.center);
  kept.rows = views_.row_parts().Of(view, *region.region, region.slots.data());
  const size_t channels = Channels();
  kept.values.resize(kept.rows->row.size() * channels);
  ParallelRanges(int64_t(kept.rows->row.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      const size_t row = size_t(kept.rows->row[i]);
      for (size_t c = 0; c < channels; ++c) {
        const bool open = !colors || colors[3 * row + c] > 0;
        kept.values[channels * i + c] = open ? values[channels * row + c] : 0.0f;
      }
    }
  });
}

void ViewSum::Finish(Buffer<float>& sum) {
  ViewReducer& reducer = views_.reducer();
  if (!reducer.AddsInOrder()) return reducer.Sum(sum);
  if (sum.empty()) return;
  const std::span<const int32_t> begins = views_.row_parts().begins();
  const size_t block = sum.size() / size_t(views_.NumActive());
  std::vector<std::span<std::byte>> parts;
  for (size_t p = 0; p + 1 < begins.size(); ++p) {
    const size_t first = size_t(begins[p]), count = size_t(begins[p + 1]) - first;
    parts.push_back(BytesOf(std::span<float>(sum.data() + first * block, count * block)));
  }
  reducer.AddInOrder(parts, [&](size_t p) {
    for (const Kept& kept : kept_) {
      const size_t first = kept.rows->begin[p];
      AddToBlocks(kept.center, kept.rows->gaussian.data() + first, kept.rows->slot.data() + first,
                  int64_t(kept.rows->begin[p + 1] - first), kept.values.data() + Channels() * first,
                  nullptr, sum.data());
    }
  });
  kept_.clear();
}

}  // namespace retint
