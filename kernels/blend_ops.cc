// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/blend_ops.h"

#include <string>

#include "kernels/check.h"

namespace retint {
namespace {

void RequireChannels(int channels) {
  if (channels < 1 || channels > kMaxChannels) {
    throw std::invalid_argument("channels must be 1 to " + std::to_string(kMaxChannels));
  }
}

}  // namespace

std::unique_ptr<Model> BlendOps::UploadModel(const GaussianArrays& host) {
  RequireCount(host.count);
  Require(host.sh_degree >= 0 && host.sh_degree <= 3, "the SH degree must be 0 to 3");
  return DoUploadModel(host);
}

std::shared_ptr<const ViewGeometry> BlendOps::PrepareView(const Model& model,
                                                          const CameraParams& camera) {
  RequireImage(camera.width, camera.height);
  return DoPrepareView(model, camera);
}

std::shared_ptr<const ViewGeometry> BlendOps::Restrict(const ViewGeometry& view,
                                                       const uint8_t* active, size_t budget_bytes,
                                                       float min_weight, const RegionBlend* blend) {
  RequireWholeView(view);
  Require(min_weight >= 0, "the least weight of a region must not be negative");
  return blend ? DoRestrictAndBlend(view, active, budget_bytes, min_weight, *blend)
               : DoRestrict(view, active, budget_bytes, min_weight);
}

std::shared_ptr<const ViewGeometry> BlendOps::DoRestrictAndBlend(const ViewGeometry& view,
                                                                 const uint8_t* active,
                                                                 size_t budget_bytes,
                                                                 float min_weight,
                                                                 const RegionBlend& blend) {
  auto region = DoRestrict(view, active, budget_bytes, min_weight);
  BlendRegion(view, *region, blend);
  return region;
}

void BlendOps::BlendRegion(const ViewGeometry& view, const ViewGeometry& region,
                           const RegionBlend& blend) {
  if (region.tiles().empty()) return;
  BlendParams params{};
  params.features = blend.colors;
  params.channels = 3;
  params.image = blend.image;
  params.pixel_rows = region.pixel_rows();
  params.tiles = region.tiles();
  DoBlend(view, params);
}

std::vector<int32_t> BlendOps::TouchedTiles(const ViewGeometry& view, const uint8_t* active) {
  RequireWholeView(view);
  return DoTouchedTiles(view, active);
}

void BlendOps::Blend(const ViewGeometry& view, const BlendParams& params) {
  RequireChannels(params.channels);
  if (params.tiles.data()) {
    RequireWholeView(view);
    int32_t last = -1;
    for (const int32_t tile : params.tiles) {
      Require(tile > last, "the tiles that are wanted must ascend");
      last = tile;
    }
    Require(last < view.tiles_x() * view.tiles_y(), "a tile that is wanted lies outside the view");
  }
  DoBlend(view, params);
}

void BlendOps::BlendShares(const ViewGeometry& view, const BlendSharesParams& params) {
  RequireWholeView(view);
  Require(params.behind >= 0 && params.behind <= params.low && params.low < params.high,
          "the share behind all Gaussians must be 0 or more, and at most the lower limit, which "
          "must be less than the upper one");
  DoBlendShares(view, params);
}

void BlendOps::BlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params) {
  RequireChannels(params.channels);
  DoBlendTranspose(view, params);
}

void BlendOps::Depth(const ViewGeometry& view, const DepthParams& params) {
  RequireWholeView(view);
  Require(!params.along_rays || (params.median && !params.expected),
          "the median, and it alone, is found along rays");
  DoDepth(view, params);
}

void BlendOps::AccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums) {
  RequireWholeView(view);
  DoAccumulateShares(view, mask, sums);
}

void BlendOps::GatherRows(const ViewGeometry& view, const float* of, int32_t channels,
                          float* values) {
  Require(channels >= 1, "rows have at least one channel");
  DoGatherRows(view, of, channels, values);
}

void BlendOps::AddRows(const ViewGeometry& view, const float* values, int32_t channels, float* sums,
                       bool and_square) {
  Require(channels >= 1, "rows have at least one channel");
  DoAddRows(view, values, channels, sums, and_square);
}

}  // namespace retint
