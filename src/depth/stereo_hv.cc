// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_hv.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "depth/network_matcher.h"
#include "depth/stereo_pairs.h"
#include "kernels/common/quantize.h"

namespace retint {
namespace {

// Disparities beyond the rough depth's own that are searched too: it is biased and has holes.
constexpr double kNearMargin = 1.2, kFarMargin = 0.75;
constexpr int kExtraDisparities = 4;
// Pixels: matchers tell no finer steps apart, so that less than this is not measured.
constexpr double kLeastDisparity = 1 / 16.0;

int RoundUp16(double value) {
  constexpr double kMost = 1e9;  // far more than is searched, and an int
  return 16 * std::max(1, int(std::ceil(std::min(value, kMost) / 16)));
}

std::string Short(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

// Checks a given baseline for a view: OptionError if even the farthest surfaces leave the image, a
// warning if not even the nearest move. Both name the range between.
std::string CheckGivenBaseline(const Camera& camera, const RoughDepths& rough, double baseline) {
  const double least = kLeastDisparity * rough.near / camera.fx();
  const double most = camera.width * rough.far / camera.fx();
  const std::string advice =
      "take one from " + Short(least) + " to " + Short(most) + ", or 0, which chooses it";
  CheckOption(baseline <= most, "a stereo baseline of " + Short(baseline) +
                                    " moves even the farthest surfaces of a view by more than its "
                                    "width: " +
                                    advice);
  if (baseline >= least) return "";
  return "a stereo baseline of " + Short(baseline) +
         " moves no surface of a view by a sixteenth of a pixel, so that nothing is measured: " +
         advice;
}

Image8 Quantize(const std::vector<float>& rgb, int width, int height) {
  Image8 out(width, height);
  std::transform(rgb.begin(), rgb.end(), out.data.begin(), ColorToByte);
  return out;
}

GridRect WholeOf(const PosedCamera& view) { return {0, 0, view.camera.width, view.camera.height}; }

// A render of a part of the reference's plane, and its luma.
struct Plate {
  Buffer<float> rgb, gray;
  GridRect rect;
  StereoView view{};
};

// One estimate. Renders come from the renderer; everything else happens in the memory of `backend`,
// which may be another.
class Estimation {
 public:
  Estimation(Renderer& renderer, Backend& backend, const PosedCamera& view, const GridRect& part,
             const StereoHvOptions& options, Monitor& monitor)
      : renderer_(renderer),
        backend_(backend),
        stereo_(backend.stereo()),
        whole_(view),
        part_(part),
        view_(view),
        options_(options),
        monitor_(monitor),
        shifts_(ShiftsOf(options)),
        pixels_(size_t(view.camera.width) * size_t(view.camera.height)),
        steps_(3 + 2 * double(shifts_.size())) {
    estimate_.depth = DepthMap(view.camera.width, view.camera.height);
    estimate_.valid = Mask(view.camera.width, view.camera.height);
  }

  // By census where `census`, and by `matcher` where not or where the search is too long for it.
  DepthEstimate Run(bool census, const StereoMatcher& matcher) {
    Advance();
    FindSearch();
    KeepPart();
    if (census && !FitCensus(search_.range)) {
      census = false;
      Warn("a search of " + std::to_string(search_.range.count) +
           " disparities is too long for the census matcher, which takes at most " +
           std::to_string(kMaxStereoCount) + ": OpenCV's StereoSGBM matched the pairs instead");
    }
    const int largest = search_.range.lowest + search_.range.count - 1;
    if (!census && largest > matcher.MostDisparity()) {
      Warn("disparities up to " + std::to_string(largest) +
           " pixels are searched, of which OpenCV's StereoSGBM finds those up to " +
           std::to_string(matcher.MostDisparity()) + ": nearer surfaces are not measured");
    }
    Advance();
    RenderPlates();
    const std::vector<Buffer<float>> pairs = census ? MatchByCensus() : MatchBy(matcher);
    Fuse(pairs);
    Arbitrate();
    Refine();
    return Finish();
  }

  // The cameras of RenderPlates(), whichever matcher is taken, and the view itself.
  std::vector<PosedCamera> Cameras(bool census) {
    FindSearch();
    if (census) FitCensus(search_.range);
    const int padding = search_.range.lowest + search_.range.count;
    std::vector<PosedCamera> cameras = {view_};
    GridRect all{0, 0, view_.camera.width, view_.camera.height};
    for (const Shift shift : shifts_) {
      const GridRect rect = PairRect(view_.camera, shift, padding);
      all = Union(all, rect);
      cameras.push_back(CropCamera(ShiftCamera(view_, shift, search_.baseline), rect));
    }
    cameras.push_back(CropCamera(view_, all));
    return cameras;
  }

 private:
  void Warn(const std::string& text) {
    if (!estimate_.warning.empty()) estimate_.warning += "; ";
    estimate_.warning += text;
  }

  void Advance(double steps = 1) {
    monitor_.Step("depth", done_, steps_);
    done_ += steps;
  }

  // In the memory that stereo works in.
  Buffer<float> Here(Buffer<float> rendered) {
    Backend& from = renderer_.backend();
    if (&from == &backend_) return rendered;
    const auto host = from.Download(rendered.data(), rendered.size());
    return backend_.Upload(std::span<const float>(host));
  }

  // False if no pixel has a rough depth.
  bool ChooseSearch(const StereoHvOptions& options) {
    const auto depths = stereo_.PositiveQuantiles(rough_.data(), int64_t(pixels_), kRoughQuantiles);
    if (depths.empty()) return false;
    if (options_.baseline > 0) {
      estimate_.warning =
          CheckGivenBaseline(whole_.camera, {depths[0], depths[1], depths[2]}, options_.baseline);
    }
    search_ = ChooseStereoSearch(view_.camera, {depths[0], depths[1], depths[2]}, options);
    return true;
  }

  void FindSearch() {
    RenderRequest request;
    request.rgb = false;
    request.depth_median = true;
    rough_ = Here(renderer_.RenderOnDevice(view_, request).depth_median);
    if (!ChooseSearch(options_)) {
      throw NoDepthError("the view sees no Gaussian: there is no depth to start from");
    }
    scale_ = float(view_.camera.fx() * search_.baseline);
  }

  // From here on the view is its part.
  void KeepPart() {
    const int width = view_.camera.width, height = view_.camera.height;
    if (part_.width == width && part_.height == height) return;
    backend_.CopyToHost(estimate_.depth.data.data(), rough_.data(), pixels_ * sizeof(float));
    view_ = CropCamera(whole_, part_);
    pixels_ = size_t(part_.width) * size_t(part_.height);
    const DepthMap rough = Crop(estimate_.depth, part_);
    rough_ = backend_.Upload(std::span<const float>(rough.data));
    StereoHvOptions options = options_;
    options.baseline = search_.baseline;
    ChooseSearch(options);
  }

  Plate MakePlate(const PosedCamera& camera, const GridRect& rect) {
    RenderRequest request;
    request.cache = false;
    Plate plate;
    plate.rgb = Here(renderer_.RenderOnDevice(CropCamera(camera, rect), request).rgb);
    const size_t pixels = size_t(rect.width) * size_t(rect.height);
    plate.gray = backend_.Allocate<float>(pixels);
    stereo_.Gray(plate.rgb.data(), int64_t(pixels), plate.gray.data());
    plate.rect = rect;
    plate.view = {plate.rgb.data(), plate.gray.data(), rect.x, rect.y,
                  rect.width,       rect.height,       0,      0};
    return plate;
  }

  void RenderPlates() {
    const int padding = search_.range.lowest + search_.range.count;
    GridRect all{0, 0, view_.camera.width, view_.camera.height};
    for (const Shift shift : shifts_) {
      const GridRect rect = PairRect(view_.camera, shift, padding);
      all = Union(all, rect);
      Plate plate = MakePlate(ShiftCamera(view_, shift, search_.baseline), rect);
      const Motion motion = MotionOf(shift);
      plate.view.dx = motion.x;
      plate.view.dy = motion.y;
      shifted_.push_back(std::move(plate));
      Advance();
    }
    reference_ = MakePlate(view_, all);
  }

  std::vector<Buffer<float>> MatchByCensus() {
    std::vector<Buffer<float>> pairs;
    for (const Plate& plate : shifted_) {
      pairs.push_back(backend_.Allocate<float>(pixels_));
      stereo_.Match({.reference = reference_.view,
                     .shifted = plate.view,
                     .width = view_.camera.width,
                     .height = view_.camera.height,
                     .lowest = search_.range.lowest,
                     .count = search_.range.count,
                     .tolerance = float(options_.left_right_tolerance),
                     .disparity = pairs.back().data()});
      Advance();
    }
    return pairs;
  }

  Image8 BytesOf(const Plate& plate) {
    return Quantize(backend_.Download(plate.rgb.data(), plate.rgb.size()), plate.rect.width,
                    plate.rect.height);
  }

  std::vector<Buffer<float>> MatchBy(const StereoMatcher& matcher) {
    const Image8 reference = BytesOf(reference_);
    std::vector<RenderedPair> rendered;
    for (size_t k = 0; k < shifts_.size(); ++k) {
      const GridRect& rect = shifted_[k].rect;
      const GridRect within{rect.x - reference_.rect.x, rect.y - reference_.rect.y, rect.width,
                            rect.height};
      rendered.push_back({shifts_[k], rect, Crop(reference, within), BytesOf(shifted_[k])});
    }
    std::vector<ScalarImage> found(shifts_.size());
    const auto match = [&](size_t k) {
      monitor_.ThrowIfCancelled();
      found[k] = MatchPair(matcher, rendered[k], view_.camera.width, view_.camera.height,
                           search_.range, options_.left_right_tolerance, monitor_);
    };
    if (options_.matcher == StereoMatcherKind::kNetwork) {
      for (size_t k = 0; k < found.size(); ++k) match(k);  // it has threads of its own
    } else {
      ParallelTasks(int64_t(found.size()), match);
    }
    matched_by_ = matcher.Identity();
    Advance(double(found.size()));
    std::vector<Buffer<float>> pairs;
    for (const ScalarImage& map : found) {
      pairs.push_back(backend_.Upload(std::span<const float>(map.data)));
    }
    return pairs;
  }

  void Fuse(const std::vector<Buffer<float>>& pairs) {
    disparity_ = backend_.Allocate<float>(pixels_);
    StereoFuseParams fuse{.pairs = {},
                          .num_pairs = 0,
                          .pixels = int64_t(pixels_),
                          .tolerance = float(options_.agree_tolerance),
                          .nearest = options_.aggregate == StereoAggregate::kMin,
                          .disparity = disparity_.data()};
    for (const auto& pair : pairs) fuse.pairs[fuse.num_pairs++] = pair.data();
    stereo_.Fuse(fuse);
  }

  // Shared by arbitration and refinement.
  template <typename Params>
  Params OverViews() const {
    Params params{};
    params.reference = reference_.view;
    for (const Plate& plate : shifted_) params.shifted[params.num_shifted++] = plate.view;
    params.width = view_.camera.width;
    params.height = view_.camera.height;
    params.disparity = disparity_.data();
    return params;
  }

  void Arbitrate() {
    if (!options_.arbitrate) {
      const auto found = backend_.Download(disparity_.data(), pixels_);
      std::vector<uint8_t> valid(pixels_);
      std::transform(found.begin(), found.end(), valid.begin(),
                     [](float s) { return s > 0 ? 255 : 0; });
      Place(valid.data(), part_, &estimate_.valid);
      return;
    }
    const auto rough = backend_.Allocate<float>(pixels_);
    measured_ = backend_.Allocate<uint8_t>(pixels_);
    stereo_.Invert(rough_.data(), nullptr, int64_t(pixels_), scale_, rough.data());
    auto params = OverViews<StereoArbitrateParams>();
    params.rough = rough.data();
    params.measured = measured_.data();
    stereo_.Arbitrate(params);
    valid_ = backend_.SendToHost(measured_.data(), pixels_);
  }

  void Refine() {
    if (options_.subpixel) stereo_.Refine(OverViews<StereoRefineParams>());
  }

  DepthEstimate Finish() {
    stereo_.Invert(disparity_.data(), rough_.data(), int64_t(pixels_), scale_, disparity_.data());
    const auto depth = backend_.SendToHost(disparity_.data(), pixels_ * sizeof(float));
    if (valid_) Place(static_cast<const uint8_t*>(valid_->Wait()), part_, &estimate_.valid);
    Place(static_cast<const float*>(depth->Wait()), part_, &estimate_.depth);
    const auto& valid = estimate_.valid.data;
    estimate_.valid_fraction =
        double(std::count(valid.begin(), valid.end(), 255)) / double(pixels_);
    estimate_.method = "stereo-hv";
    estimate_.reason = StereoReason(shifts_.size(), search_, estimate_.valid_fraction, matched_by_);
    if (!estimate_.warning.empty()) estimate_.reason += "; " + estimate_.warning;
    done_ = steps_;
    Advance();
    return std::move(estimate_);
  }

  Renderer& renderer_;
  Backend& backend_;
  StereoOps& stereo_;
  const PosedCamera& whole_;
  const GridRect part_;
  PosedCamera view_;  // the whole, then its part
  const StereoHvOptions& options_;
  Monitor& monitor_;
  const std::vector<Shift> shifts_;
  size_t pixels_;
  const double steps_;
  double done_ = 0;
  StereoSearch search_;
  float scale_ = 0;                  // depth times disparity
  Buffer<float> rough_, disparity_;  // [H, W] depth of the Gaussians; of stereo
  Buffer<uint8_t> measured_;         // [H, W] where stereo was believed
  std::unique_ptr<Arrival> valid_;   // the same, on its way
  std::vector<Plate> shifted_;
  Plate reference_;
  std::string matched_by_;  // the identity of a network
  DepthEstimate estimate_;
};

}  // namespace

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
  if (!matcher_ && options_.matcher == StereoMatcherKind::kNetwork) matcher_ = NetworkOf(options_);
  if (!matcher_) matcher_ = MakeSgbmMatcher(options_.sgbm);
}

StereoHvEstimator::~StereoHvEstimator() = default;

std::vector<PosedCamera> StereoHvEstimator::Cameras(const PosedCamera& view, Monitor& monitor) {
  return Estimation(renderer_, renderer_.backend(), view, WholeOf(view), options_, monitor)
      .Cameras(census_);
}

DepthEstimate StereoHvEstimator::Estimate(const PosedCamera& view, Monitor& monitor) {
  return EstimatePart(view, WholeOf(view), monitor);
}

DepthEstimate StereoHvEstimator::EstimatePart(const PosedCamera& view, const GridRect& part,
                                              Monitor& monitor) {
  try {
    return Estimation(renderer_, renderer_.backend(), view, part, options_, monitor)
        .Run(census_, *matcher_);
  } catch (const std::bad_alloc&) {
    // The volumes of costs do not fit on the device: the host has room.
  }
  const auto host = CreateBackend("cpu");
  return Estimation(renderer_, *host, view, part, options_, monitor).Run(census_, *matcher_);
}

}  // namespace retint
