// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_device.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "depth/stereo_pairs.h"
#include "kernels/stereo_ops.h"

namespace retint {
namespace {

// A render of a part of the reference's plane, and its luma.
struct Plate {
  Buffer<float> rgb, gray;
  StereoView view;
};

Plate MakePlate(Renderer& renderer, const PosedCamera& camera, const PixelRect& rect) {
  RenderRequest request;
  request.cache = false;
  Plate plate;
  plate.rgb = renderer.RenderOnDevice(CropCamera(camera, rect), request).rgb;
  const size_t pixels = size_t(rect.width) * size_t(rect.height);
  plate.gray = renderer.backend().Allocate<float>(pixels);
  renderer.backend().stereo()->Gray(plate.rgb.data(), int64_t(pixels), plate.gray.data());
  plate.view = {plate.rgb.data(), plate.gray.data(), rect.x, rect.y, rect.width, rect.height, 0, 0};
  return plate;
}

Plate MakeShiftedPlate(Renderer& renderer, const PosedCamera& camera, Shift shift, double baseline,
                       const PixelRect& rect) {
  Plate plate = MakePlate(renderer, ShiftCamera(camera, shift, baseline), rect);
  const Motion motion = MotionOf(shift);
  plate.view.dx = motion.x;
  plate.view.dy = motion.y;
  return plate;
}

}  // namespace

std::optional<DepthEstimate> EstimateStereoOnDevice(Renderer& renderer, const PosedCamera& view,
                                                    const StereoHvOptions& options,
                                                    Monitor& monitor) {
  Backend& backend = renderer.backend();
  StereoOps& stereo = *backend.stereo();
  const std::vector<Shift> shifts = ShiftsOf(options);
  const double steps = 3 + 2 * double(shifts.size());
  double done = 0;
  monitor.Step("depth", done++, steps);

  RenderRequest rough_request;
  rough_request.rgb = false;
  rough_request.depth_median = true;
  const Buffer<float> rough = renderer.RenderOnDevice(view, rough_request).depth_median;
  const auto quantiles =
      stereo.PositiveQuantiles(rough.data(), int64_t(rough.size()), kRoughQuantiles);
  if (quantiles.empty()) ThrowNoRoughDepth();
  const RoughDepths range{quantiles[0], quantiles[1], quantiles[2]};
  StereoSearch search = ChooseStereoSearch(view.camera, range, options);
  if (!FitCensus(search.range)) return std::nullopt;
  const int count = search.range.count;
  monitor.Step("depth", done++, steps);

  const int width = view.camera.width, height = view.camera.height;
  const size_t pixels = size_t(width) * size_t(height);
  PixelRect all{0, 0, width, height};
  std::vector<Plate> shifted;
  for (const Shift shift : shifts) {
    const PixelRect rect = PairRect(view.camera, shift, search.range.lowest + count);
    all = Union(all, rect);
    shifted.push_back(MakeShiftedPlate(renderer, view, shift, search.baseline, rect));
    monitor.Step("depth", done++, steps);
  }
  const Plate reference = MakePlate(renderer, view, all);

  std::vector<Buffer<float>> pairs;
  StereoFuseParams fuse{};
  for (const Plate& plate : shifted) {
    pairs.push_back(backend.Allocate<float>(pixels));
    stereo.Match({.reference = reference.view,
                  .shifted = plate.view,
                  .width = width,
                  .height = height,
                  .lowest = search.range.lowest,
                  .count = count,
                  .tolerance = float(options.left_right_tolerance),
                  .disparity = pairs.back().data()});
    fuse.pairs[fuse.num_pairs++] = pairs.back().data();
    monitor.Step("depth", done++, steps);
  }
  const auto disparity = backend.Allocate<float>(pixels);
  fuse.pixels = int64_t(pixels);
  fuse.tolerance = float(options.agree_tolerance);
  fuse.nearest = options.aggregate == StereoAggregate::kMin;
  fuse.disparity = disparity.data();
  stereo.Fuse(fuse);

  const float scale = float(view.camera.fx() * search.baseline);
  DepthEstimate estimate;
  estimate.valid = Mask(width, height, 0);
  StereoView views[kMaxStereoViews] = {};
  for (size_t k = 0; k < shifted.size(); ++k) views[k] = shifted[k].view;
  if (options.arbitrate) {
    const auto rough_disparity = backend.Allocate<float>(pixels);
    const auto measured = backend.Allocate<uint8_t>(pixels);
    stereo.Invert(rough.data(), nullptr, int64_t(pixels), scale, rough_disparity.data());
    StereoArbitrateParams arbitrate{};
    arbitrate.reference = reference.view;
    std::copy(std::begin(views), std::end(views), arbitrate.shifted);
    arbitrate.num_shifted = int32_t(shifted.size());
    arbitrate.width = width;
    arbitrate.height = height;
    arbitrate.rough = rough_disparity.data();
    arbitrate.disparity = disparity.data();
    arbitrate.measured = measured.data();
    stereo.Arbitrate(arbitrate);
    backend.CopyToHost(estimate.valid.data.data(), measured.data(), pixels);
  } else {
    const auto found = backend.Download(disparity.data(), pixels);
    std::transform(found.begin(), found.end(), estimate.valid.data.begin(),
                   [](float s) { return s > 0 ? 255 : 0; });
  }
  if (options.refine) {
    StereoRefineParams refine{};
    refine.reference = reference.view;
    std::copy(std::begin(views), std::end(views), refine.shifted);
    refine.num_shifted = int32_t(shifted.size());
    refine.width = width;
    refine.height = height;
    refine.disparity = disparity.data();
    stereo.Refine(refine);
  }
  stereo.Invert(disparity.data(), rough.data(), int64_t(pixels), scale, disparity.data());
  estimate.depth = DepthMap(width, height);
  backend.CopyToHost(estimate.depth.data.data(), disparity.data(), pixels * sizeof(float));

  estimate.method = "stereo-hv";
  estimate.valid_fraction =
      double(std::count(estimate.valid.data.begin(), estimate.valid.data.end(), 255)) /
      double(pixels);
  estimate.reason = StereoReason(shifts.size(), search, estimate.valid_fraction);
  monitor.Step("depth", steps, steps);
  return estimate;
}

}  // namespace retint
