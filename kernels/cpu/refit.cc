// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "base/parallel.h"
#include "kernels/common/loss.h"
#include "kernels/common/quantize.h"
#include "kernels/cpu/blend.h"
#include "kernels/cpu/geometry.h"
#include "kernels/cpu/groups.h"

namespace retint {
namespace {

constexpr int64_t kRows = 1 << 14;  // a task

// Calls body(first, pixel, count) for the pixel rows of a region's tile. `first` and `pixel` number
// the row's first pixel in the region and in the image; `count` of its pixels lie inside the image.
template <typename Body>
void ForTileRows(const ViewGeometry& region, size_t tile, const Body& body) {
  const int id = region.tiles()[tile], step = region.pixel_row_step();
  const int x0 = id % region.tiles_x() * kTileSize, y0 = id / region.tiles_x() * kTileSize;
  const int width = region.camera().width, count = std::min(kTileSize, width - x0);
  size_t first = tile * size_t(region.num_pixel_rows() * kTileSize);
  for (int y = y0; y < std::min(y0 + kTileSize, region.camera().height); y += step) {
    body(first, size_t(y) * size_t(width) + size_t(x0), count);
    first += kTileSize;
  }
}

// body(y) for the rows of a box.
template <typename Body>
void ForBoxRows(const int32_t* box, const Body& body) {
  ParallelRanges(box[3] - box[1], 16, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) body(box[1] + int(y));
  });
}

class CpuRefitOps : public RefitOps {
 public:
  CpuRefitOps(BlendOps& blend, const LossKernels& loss, const TileKernels& tiles,
              EditColorsKernel edit_colors)
      : RefitOps(blend), loss_(loss), tiles_(tiles), edit_colors_(edit_colors) {}

 protected:
  void DoRegionTarget(const ViewGeometry& view, const RegionTargetParams& params) override;
  void DoRegionResidual(const ViewGeometry& view, const RegionResidualParams& params) override;
  void DoRegionSweep(const ViewGeometry& view, const RegionSweepParams& params) override;
  void DoRegionAdd(const ViewGeometry& view, float* image, const float* delta) override;
  void DoRegionWeightImage(const ViewGeometry& view, const uint8_t* weights, float* image) override;
  void DoMarkRows(const ViewGeometry& view, uint8_t* seen) override;
  void DoNumberRows(const ViewGeometry& view, const int32_t* number_of, int32_t* numbers) override;
  ImageLossValue DoImageLoss(const ImageLossParams& params) override;
  void DoPackBox(const PackBoxParams& params) override;
  void DoUnpackBox(const PackBoxParams& params) override;
  void DoEditImage(const EditImageParams& params) override;

 private:
  const LossKernels& loss_;
  const TileKernels& tiles_;
  EditColorsKernel edit_colors_;
  ScratchPool scratch_;
};

void CpuRefitOps::DoRegionTarget(const ViewGeometry& view, const RegionTargetParams& params) {
  const float* source = params.source ? params.source : params.render;
  const float scale = 1 / params.unit;
  uint8_t weight_of[256];
  for (int m = 0; m < 256; ++m)
    weight_of[m] = PixelWeight(uint8_t(m), params.inside_weight, params.outside_weight);
  ParallelTasks(int64_t(view.tiles().size()), [&](int64_t i) {
    const int64_t of_tile = view.num_pixel_rows() * kTileSize;
    std::fill_n(params.target + i * of_tile * 3, of_tile * 3, int16_t(0));
    if (params.weights) std::fill_n(params.weights + i * of_tile, of_tile, uint8_t(0));
    ForTileRows(view, size_t(i), [&](size_t first, size_t pixel, int count) {
      const uint8_t* mask = params.mask + pixel;
      const float* render = params.render + 3 * pixel;
      float edited[3 * kTileSize];
      edit_colors_(params.map, mask, source + 3 * pixel, count, edited);
      int16_t* target = params.target + 3 * first;
      for (int j = 0; j < 3 * count; ++j) target[j] = ToSignedSteps(edited[j] - render[j], scale);
      for (int x = 0; params.weights && x < count; ++x) {
        params.weights[first + size_t(x)] = weight_of[mask[x]];
      }
    });
  });
}

void CpuRefitOps::DoRegionResidual(const ViewGeometry& view, const RegionResidualParams& params) {
  if (params.curvature) {
    std::fill_n(params.curvature, size_t(view.camera().width) * size_t(view.camera().height), 0.0f);
  }
  *params.loss += OrderedSum(int64_t(view.tiles().size()), 1, [&](int64_t i, int64_t) {
    double sum = 0;
    ForTileRows(view, size_t(i), [&](size_t first, size_t pixel, int count) {
      const uint8_t* of_pixels = params.weights ? params.weights + first : nullptr;
      const int16_t* target = params.target + 3 * first;
      const float* image = params.image + 3 * pixel;
      float* residual = params.residual + 3 * pixel;
      float row = 0;
      for (int x = 0; x < count; ++x, target += 3, image += 3, residual += 3) {
        const float weight = of_pixels ? float(of_pixels[x]) * (1.0f / 255) : 1.0f;
        const float slope = SlopeAt(params.stay, target);
        float curvature = 0;
        for (int c = 0; c < 3; ++c) {
          const float r = float(target[c]) * params.unit - image[c];
          const ResidualCost cost = CostOf(r, slope, params.stay.bend);
          residual[c] = weight * cost.curvature * r;
          row += weight * cost.value;
          curvature += weight * cost.curvature;
        }
        if (params.curvature) params.curvature[pixel + size_t(x)] = curvature / 3;
      }
      sum += double(row);
    });
    return sum;
  });
}

// Explicit weights stay in a core's cache from the blend to its transpose.
void CpuRefitOps::DoRegionSweep(const ViewGeometry& view, const RegionSweepParams& params) {
  const auto& region = dynamic_cast<const CpuViewGeometry&>(view);
  if (region.weights.empty()) return RefitOps::DoRegionSweep(view, params);
  const size_t of_tile = size_t(view.num_pixel_rows() * kTileSize);
  auto partials = scratch_.Take(params.result ? size_t(region.num_slots()) * 3 : 0);
  *params.loss += OrderedSum(int64_t(region.weights.size()), 4, [&](int64_t begin, int64_t end) {
    double loss = 0;
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      const WeightTile& weights = region.weights[i];
      alignas(64) float values[3 * kTilePixels] = {};
      tiles_.blend_weights(weights, params.change, 3, values);
      loss += tiles_.residual(params.target + i * of_tile * 3, params.unit,
                              params.weights + i * of_tile, region.pixel_row_step(), params.stay,
                              values);
      if (params.result) tiles_.transpose_weights(weights, values, 3, partials.data());
    }
    return loss;
  });
  if (params.result) SumPartials(region, partials.data(), 3, params.result);
}

void CpuRefitOps::DoRegionAdd(const ViewGeometry& view, float* image, const float* delta) {
  ParallelRanges(int64_t(view.tiles().size()), 16, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      ForTileRows(view, size_t(i), [&](size_t, size_t pixel, int count) {
        for (size_t j = 3 * pixel; j < 3 * (pixel + size_t(count)); ++j) image[j] += delta[j];
      });
    }
  });
}

void CpuRefitOps::DoRegionWeightImage(const ViewGeometry& view, const uint8_t* weights,
                                      float* image) {
  std::fill_n(image, size_t(view.camera().width) * size_t(view.camera().height), 0.0f);
  ParallelRanges(int64_t(view.tiles().size()), 16, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      ForTileRows(view, size_t(i), [&](size_t first, size_t pixel, int count) {
        for (size_t x = 0; x < size_t(count); ++x) {
          image[pixel + x] = float(weights[first + x]) * (1.0f / 255);
        }
      });
    }
  });
}

void CpuRefitOps::DoMarkRows(const ViewGeometry& view, uint8_t* seen) {
  ParallelRanges(view.num_rows(), kRows, [&](int64_t begin, int64_t end) {
    for (int64_t r = begin; r < end; ++r) seen[view.rows()[r]] = 1;
  });
}

void CpuRefitOps::DoNumberRows(const ViewGeometry& view, const int32_t* number_of,
                               int32_t* numbers) {
  ParallelRanges(view.num_rows(), kRows, [&](int64_t begin, int64_t end) {
    for (int64_t r = begin; r < end; ++r) numbers[r] = number_of[view.rows()[r]];
  });
}

ImageLossValue CpuRefitOps::DoImageLoss(const ImageLossParams& params) {
  const ImageLossValue value = ImageLossOnCpu(loss_, params);
  if (!params.loss) return value;
  *params.loss += value.loss;
  return {};
}

void CpuRefitOps::DoPackBox(const PackBoxParams& params) {
  const size_t row = size_t(params.box[2] - params.box[0]) * 3;
  const float scale = 1 / params.unit;
  ForBoxRows(params.box, [&](int y) {
    const float* in = params.image + (size_t(y) * size_t(params.width) + size_t(params.box[0])) * 3;
    uint16_t* out = params.packed + size_t(y - params.box[1]) * row;
    for (size_t i = 0; i < row; ++i) out[i] = ToSteps(in[i], scale);
  });
}

void CpuRefitOps::DoUnpackBox(const PackBoxParams& params) {
  const size_t row = size_t(params.box[2] - params.box[0]) * 3;
  ForBoxRows(params.box, [&](int y) {
    float* out = params.image + (size_t(y) * size_t(params.width) + size_t(params.box[0])) * 3;
    const uint16_t* in = params.packed + size_t(y - params.box[1]) * row;
    for (size_t i = 0; i < row; ++i) out[i] = float(in[i]) * params.unit;
  });
}

void CpuRefitOps::DoEditImage(const EditImageParams& params) {
  ForBoxRows(params.box, [&](int y) {
    const size_t first = size_t(y) * size_t(params.width) + size_t(params.box[0]);
    edit_colors_(params.map, params.mask ? params.mask + first : nullptr, params.image + 3 * first,
                 params.box[2] - params.box[0], params.out + 3 * first);
  });
}

}  // namespace

std::unique_ptr<RefitOps> MakeCpuRefitOps(BlendOps& blend, const LossKernels& loss,
                                          const TileKernels& tiles, EditColorsKernel edit_colors) {
  return std::make_unique<CpuRefitOps>(blend, loss, tiles, edit_colors);
}

}  // namespace retint
