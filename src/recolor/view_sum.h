// SPDX-License-Identifier: BSD-3-Clause
// Sums over all views into blocks of the active Gaussians. Internal to recolor.
#pragma once

#include <cstdint>
#include <vector>

#include "recolor/refit_views.h"

namespace retint {

// sum [active, *] += each view's part for the Gaussians that it sees, in the order of the views. A
// view's part is added at once, unless it must wait for its turn (ViewReducer::AddsInOrder()). Then
// it is kept, by row and 16 times smaller than the blocks, and Finish() adds it.
class ViewSum {
 public:
  enum class Kind {
    kGradient,  // Y(d) g^T of a color gradient g, [active, K, 3]
    kBlocks     // w Y(d) Y(d)^T of a weight w, packed triangles, [active, K (K + 1) / 2]
  };
  ViewSum(RefitViews& views, Kind kind) : views_(views), kind_(kind) {}

  // `values` [rows, 3] or [rows], of an own view, the views in ascending order; `colors`
  // [rows, 3] as in EvalShTransposeParams, or null.
  void Add(size_t view, const RegionView& region, const float* values, const float* colors,
           Buffer<float>& sum);
  // Collective; after all views.
  void Finish(Buffer<float>& sum);

 private:
  struct Kept {
    float center[3];
    std::shared_ptr<const RowsByPart> rows;
    std::vector<float> values;  // of `rows`, [*, channels]
  };

  void AddToBlocks(const float* center, const int32_t* gaussians, const int32_t* slots,
                   int64_t count, const float* values, const float* colors, float* sum);
  size_t Channels() const { return kind_ == Kind::kGradient ? 3 : 1; }

  RefitViews& views_;
  Kind kind_;
  std::vector<Kept> kept_;
};

}  // namespace retint
