// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_hv.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "depth/stereo_device.h"
#include "depth/stereo_pairs.h"

namespace retint {
namespace {

// Disparities beyond the rough depth's own that are searched too: it is biased and has holes.
constexpr double kNearMargin = 1.2, kFarMargin = 0.75;
constexpr int kExtraDisparities = 4;

int RoundUp16(double value) { return 16 * std::max(1, int(std::ceil(value / 16))); }

Image8 Quantize(const Image& image) {
  Image8 out(image.width, image.height);
  for (size_t i = 0; i < out.data.size(); ++i) {
    out.data[i] = uint8_t(std::clamp(image.data[i], 0.0f, 1.0f) * 255 + 0.5f);
  }
  return out;
}

Image8 Crop(const Image8& image, const PixelRect& rect) {
  Image8 out(rect.width, rect.height);
  for (int y = 0; y < rect.height; ++y) {
    std::copy_n(&image(rect.x, rect.y + y), size_t(rect.width) * 3, &out(0, y));
  }
  return out;
}

// StereoOps::Gray.
ScalarImage Gray(const Image& image, const PixelRect& rect) {
  ScalarImage out(rect.width, rect.height);
  for (int y = 0; y < rect.height; ++y) {
    const float* rgb = &image(rect.x, rect.y + y);
    for (int x = 0; x < rect.width; ++x, rgb += 3) {
      const auto unit = [&](int c) { return std::clamp(rgb[c], 0.0f, 1.0f); };
      out(x, y) = 0.299f * unit(0) + 0.587f * unit(1) + 0.114f * unit(2);
    }
  }
  return out;
}

}  // namespace

StereoSearch ChooseStereoSearch(const Camera& camera, const DepthMap& rough,
                                const StereoHvOptions& options) {
  std::vector<float> depths;
  depths.reserve(rough.data.size());
  std::copy_if(rough.data.begin(), rough.data.end(), std::back_inserter(depths),
               [](float depth) { return depth > 0; });
  if (depths.empty()) ThrowNoRoughDepth();
  const auto quantile = [&](double q) {
    const auto nth = depths.begin() + std::ptrdiff_t(q * double(depths.size() - 1));
    std::nth_element(depths.begin(), nth, depths.end());
    return double(*nth);
  };
  return ChooseStereoSearch(camera,
                            RoughDepths{quantile(kRoughQuantiles[0]), quantile(kRoughQuantiles[1]),
                                        quantile(kRoughQuantiles[2])},
                            options);
}

StereoSearch ChooseStereoSearch(const Camera& camera, const RoughDepths& rough,
                                const StereoHvOptions& options) {
  StereoSearch search;
  const bool automatic = options.baseline == 0;
  search.baseline = automatic ? options.median_disparity * camera.width * rough.median / camera.fx()
                              : options.baseline;
  const auto range = [&] {
    const double scale = camera.fx() * search.baseline;
    const int lowest = std::max(0, int(scale / rough.far * kFarMargin) - kExtraDisparities);
    return DisparityRange{lowest,
                          RoundUp16(scale / rough.near * kNearMargin + kExtraDisparities - lowest)};
  };
  search.range = range();
  while (automatic && search.range.count > options.max_disparities) {
    search.baseline *= 0.95;
    search.range = range();
  }
  search.range.count = std::min(search.range.count, options.max_disparities);
  return search;
}

StereoHvEstimator::StereoHvEstimator(Renderer& renderer, const StereoHvOptions& options,
                                     std::unique_ptr<StereoMatcher> matcher)
    : renderer_(renderer),
      options_(options),
      census_(options.matcher == StereoMatcherKind::kCensus && !matcher),
      matcher_(std::move(matcher)) {
  options_.Check();
  if (!matcher_) matcher_ = MakeSgbmMatcher(options_.sgbm);
}

StereoHvEstimator::~StereoHvEstimator() = default;

DepthEstimate StereoHvEstimator::Estimate(const PosedCamera& view, Monitor& monitor) {
  if (census_ && renderer_.backend().stereo()) {
    try {
      if (auto found = EstimateStereoOnDevice(renderer_, view, options_, monitor)) return *found;
    } catch (const std::bad_alloc&) {
      // The volumes of costs do not fit: the host has room.
    }
  }
  return EstimateOnHost(view, monitor);
}

DepthEstimate StereoHvEstimator::EstimateOnHost(const PosedCamera& view, Monitor& monitor) {
  const std::vector<Shift> shifts = ShiftsOf(options_);
  const double steps = 3 + 3 * double(shifts.size());
  double done = 0;
  monitor.Step("depth", done++, steps);

  RenderRequest rough_request;
  rough_request.rgb = false;
  rough_request.depth_median = true;
  RenderOutput rough = renderer_.Render(view, rough_request);
  StereoSearch search = ChooseStereoSearch(view.camera, rough.depth_median, options_);
  const bool census = census_ && FitCensus(search.range);
  const int width = view.camera.width, height = view.camera.height;
  const int padding = search.range.lowest + search.range.count;
  monitor.Step("depth", done++, steps);

  RenderRequest request;
  request.cache = false;
  std::vector<RenderedPair> rendered(shifts.size());
  std::vector<ShiftedGray> grays(shifts.size());
  PixelRect all{0, 0, width, height};
  for (size_t k = 0; k < shifts.size(); ++k) {
    const PixelRect rect = PairRect(view.camera, shifts[k], padding);
    all = Union(all, rect);
    const PosedCamera shifted = ShiftCamera(view, shifts[k], search.baseline);
    const Image image = renderer_.Render(CropCamera(shifted, rect), request).rgb;
    rendered[k] = {shifts[k], rect, {}, Quantize(image)};
    grays[k] = {shifts[k], rect, Gray(image, {0, 0, rect.width, rect.height})};
    monitor.Step("depth", done++, steps);
  }
  const Image reference = renderer_.Render(CropCamera(view, all), request).rgb;
  const Image8 reference8 = Quantize(reference);
  for (RenderedPair& pair : rendered) {
    pair.reference = Crop(
        reference8, {pair.rect.x - all.x, pair.rect.y - all.y, pair.rect.width, pair.rect.height});
  }

  std::vector<ScalarImage> pairs(shifts.size());
  if (census) {  // one after the other: each uses all threads
    const ScalarImage gray = Gray(reference, {0, 0, all.width, all.height});
    for (size_t k = 0; k < shifts.size(); ++k) {
      pairs[k] = MatchCensus(gray, all, grays[k], width, height, search.range,
                             options_.left_right_tolerance);
      monitor.Step("depth", done += 2, steps);
    }
  } else {
    ParallelTasks(int64_t(shifts.size()), [&](size_t k) {
      monitor.ThrowIfCancelled();
      pairs[k] = MatchPair(*matcher_, rendered[k], width, height, search.range,
                           options_.left_right_tolerance);
    });
    monitor.Step("depth", done += 2 * double(shifts.size()), steps);
  }

  ScalarImage disparity = FuseDisparities(pairs, options_.aggregate, options_.agree_tolerance);
  const float scale = float(view.camera.fx() * search.baseline);
  Mask valid(width, height, 0);
  if (options_.arbitrate) {
    ScalarImage rough_disparity(width, height, -1.0f);
    for (size_t i = 0; i < disparity.data.size(); ++i) {
      const float depth = rough.depth_median.data[i];
      if (depth > 0) rough_disparity.data[i] = scale / depth;
    }
    valid = ArbitrateDisparity(rendered, rough_disparity, disparity);
  } else {
    std::transform(disparity.data.begin(), disparity.data.end(), valid.data.begin(),
                   [](float s) { return s > 0 ? 255 : 0; });
  }
  if (options_.refine) {
    RefineDisparity(Gray(reference, {-all.x, -all.y, width, height}), grays, disparity);
  }

  DepthEstimate estimate;
  estimate.method = "stereo-hv";
  estimate.depth = std::move(rough.depth_median);
  for (size_t i = 0; i < disparity.data.size(); ++i) {
    if (disparity.data[i] > 0) estimate.depth.data[i] = scale / disparity.data[i];
  }
  estimate.valid_fraction =
      double(std::count(valid.data.begin(), valid.data.end(), 255)) / double(valid.NumPixels());
  estimate.valid = std::move(valid);
  estimate.reason = StereoReason(shifts.size(), search, estimate.valid_fraction);
  monitor.Step("depth", steps, steps);
  return estimate;
}

}  // namespace retint
