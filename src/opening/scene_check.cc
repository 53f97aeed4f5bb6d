// SPDX-License-Identifier: BSD-3-Clause
#include "opening/scene_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/median.h"
#include "kernels/common/types.h"

namespace retint {
namespace {

constexpr size_t kNamesShown = 3;

std::string Fixed(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

// Every step-th part of both sides, each of its pixels the mean of step x step.
PosedCamera Reduced(const PosedCamera& posed, int step) {
  const Camera& camera = posed.camera;
  return {Camera::Pinhole(camera.id, camera.width / step, camera.height / step, camera.fx() / step,
                          camera.fy() / step, camera.cx() / step, camera.cy() / step),
          posed.cam_from_world};
}

Image Reduced(const Image& image, int step) {
  Image small(image.width / step, image.height / step);
  const float weight = 1.0F / static_cast<float>(step * step);
  for (int y = 0; y < small.height * step; ++y) {
    for (int x = 0; x < small.width * step; ++x) {
      for (size_t c = 0; c < 3; ++c) {
        small.data[small.Index(x / step, y / step) + c] +=
            weight * image.data[image.Index(x, y) + c];
      }
    }
  }
  return small;
}

// 255 where all of step x step pixels are.
Mask Reduced(const Mask& mask, int step) {
  Mask small(mask.width / step, mask.height / step, 255);
  for (int y = 0; y < small.height * step; ++y) {
    for (int x = 0; x < small.width * step; ++x) {
      uint8_t& value = small(x / step, y / step);
      value = std::min(value, mask(x, y));
    }
  }
  return small;
}

// Keeps of `reach` the pixels that a render covers, unless they are next to none.
void KeepCovered(const ScalarImage& alpha, Mask* reach) {
  constexpr float kCovered = 0.5F;
  constexpr size_t kLeastShare = 100;  // a hundredth
  Mask covered = *reach;
  size_t before = 0, after = 0;
  for (size_t i = 0; i < covered.data.size(); ++i) {
    before += covered.data[i] > 0;
    if (alpha.data[i] < kCovered) covered.data[i] = 0;
    after += covered.data[i] > 0;
  }
  if (after * kLeastShare >= before) *reach = std::move(covered);
}

// Over the pixels inside `reach`; empty: all.
double Psnr(const Image& render, const Image& photo, const Mask& reach) {
  double sum = 0, count = 0;
  for (size_t i = 0; i < render.data.size(); ++i) {
    if (!reach.Empty() && reach.data[i / 3] == 0) continue;
    const double difference = std::clamp(render.data[i], 0.0F, 1.0F) - photo.data[i];
    sum += difference * difference;
    count += 1;
  }
  return -10 * std::log10(std::max(sum / std::max(count, 1.0), 1e-10));
}

// Of a render that is moved by whole pixels over the photo; both without a border of `reach`.
double MovedPsnr(const Image& render, const Image& photo, int right, int down, int reach) {
  double sum = 0;
  const size_t values = 3 * size_t(photo.width - 2 * reach);
  for (int y = reach; y < photo.height - reach; ++y) {
    const float* const is = &photo.data[photo.Index(reach, y)];
    const float* const shows = &render.data[render.Index(reach + right, y + down)];
    float row = 0;
    for (size_t i = 0; i < values; ++i) {
      const float difference = std::clamp(shows[i], 0.0F, 1.0F) - is[i];
      row += difference * difference;
    }
    sum += double(row);
  }
  const double count = double(values) * (photo.height - 2 * reach);
  return -10 * std::log10(std::max(sum / count, 1e-10));
}

// If a splat lies elsewhere in the world than its photos say, its render shows things beside their
// place.
void MoveAbout(const Image& render, const Image& photo, ViewComparison* comparison) {
  constexpr int kLongest = 200, kStep = 2;  // pixels
  const int longest = std::max(photo.width, photo.height);
  const int step = std::max(1, longest / kLongest);
  const Image small_render = Reduced(render, step), small_photo = Reduced(photo, step);
  const int side = std::max(small_photo.width, small_photo.height);
  const int reach = side * 8 / 100 / kStep * kStep;
  if (reach < kStep || 4 * reach > std::min(small_photo.width, small_photo.height)) return;
  const double as_is = MovedPsnr(small_render, small_photo, 0, 0, reach);
  for (int down = -reach; down <= reach; down += kStep) {
    for (int right = -reach; right <= reach; right += kStep) {
      const double gain = MovedPsnr(small_render, small_photo, right, down, reach) - as_is;
      if (gain <= comparison->gain) continue;
      comparison->gain = gain;
      comparison->moved = std::hypot(right, down) / side;
    }
  }
}

double ShareTooNear(const View& view, const Reconstruction& model) {
  const PosedCamera posed = model.Posed(view);
  double seen = 0, near = 0;
  for (const Observation& observation : view.observations) {
    const auto point = model.points.find(observation.point_id);
    if (point == model.points.end()) continue;
    const double z = (posed.cam_from_world * point->second.xyz).z();
    seen += z > 0;
    near += z > 0 && z <= double(kNearPlane);
  }
  return seen > 0 ? near / seen : std::numeric_limits<double>::quiet_NaN();
}

ViewComparison Compare(OpenScene& scene, const View& view, const SceneCheckOptions& options) {
  const PosedCamera posed = scene.reconstruction().Posed(view);
  const int width = posed.camera.width, height = posed.camera.height;
  const int longest = options.longest_side;
  const int step =
      longest > 0 ? std::max(1, std::min({std::max(width, height) / longest, width, height})) : 1;
  RenderRequest request;
  request.alpha = true;
  request.cache = false;
  const RenderOutput output = scene.renderer().Render(Reduced(posed, step), request);
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const double near = ShareTooNear(view, scene.reconstruction());
  ViewComparison comparison{view.name, kUnknown, 0, kUnknown, kUnknown, near};
  for (const float alpha : output.alpha.data) comparison.coverage += alpha;
  comparison.coverage /= static_cast<double>(std::max<size_t>(1, output.alpha.data.size()));
  if (!scene.workspace().HasPhoto(view)) return comparison;
  try {
    const Workspace& workspace = scene.workspace();
    const Image photo = Reduced(workspace.ReadPhoto(view), step);
    const DistortedPhoto* const of = workspace.PhotoOf(view);
    Mask reach = of ? Reduced(workspace.photo_pixels->Reach(view.id), step) : Mask();
    // Photos that take several views show more than most splats hold.
    if (of && of->faces.size() > 1) KeepCovered(output.alpha, &reach);
    comparison.psnr = Psnr(output.rgb, photo, reach);
    comparison.gain = comparison.moved = 0;
    if (reach.Empty()) MoveAbout(output.rgb, photo, &comparison);
  } catch (const InputError&) {
    if (options.strict) throw;  // else its fault is named where the photo is wanted
  }
  return comparison;
}

// The views of each photo, by name; those of cameras without distortion each alone.
std::vector<std::vector<const View*>> ByPicture(const Workspace& workspace,
                                                const std::vector<const View*>& views) {
  std::vector<std::vector<const View*>> pictures;
  std::map<const DistortedPhoto*, size_t> place;
  for (const View* view : views) {
    const DistortedPhoto* const photo = workspace.PhotoOf(*view);
    const auto [at, is_new] = place.try_emplace(photo, pictures.size());
    if (!photo || is_new) {
      pictures.push_back({view});
    } else {
      pictures[at->second].push_back(view);
    }
  }
  return pictures;
}

// Where a view's photo was looked for.
std::string FullPath(const Workspace& workspace, const View& view) {
  return std::filesystem::absolute(workspace.PhotoPath(view)).lexically_normal().string();
}

std::string MissingPhotos(const Workspace& workspace, const SceneCheck& check) {
  std::string line = "photos of " + std::to_string(check.missing_photos.size()) + " of " +
                     std::to_string(check.views) + " views are missing: ";
  for (size_t i = 0; i < std::min(kNamesShown, check.missing_photos.size()); ++i) {
    line += (i > 0 ? ", " : "") + check.missing_photos[i];
  }
  if (check.missing_photos.size() > kNamesShown) line += ", ...";
  const View* first = workspace.reconstruction.FindView(check.missing_photos.front());
  return line + "; there is no " + FullPath(workspace, *first);
}

// The median of the comparisons.
void TakeMedians(SceneCheck* check) {
  std::vector<double> psnr, coverage, gain, moved, near;
  for (const ViewComparison& one : check->comparisons) {
    coverage.push_back(one.coverage);
    if (!std::isnan(one.near)) near.push_back(one.near);
    if (std::isnan(one.psnr)) continue;
    psnr.push_back(one.psnr);
    gain.push_back(one.gain);
    moved.push_back(one.moved);
  }
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  check->median_psnr = Median(std::move(psnr), kUnknown);
  check->median_coverage = Median(std::move(coverage), kUnknown);
  check->median_gain = Median(std::move(gain), kUnknown);
  check->median_moved = Median(std::move(moved), kUnknown);
  check->median_near = Median(std::move(near), kUnknown);
}

}  // namespace

bool CoversTooLittle(const SceneCheck& check, const SceneCheckOptions& options) {
  constexpr double kWithPhotos = 0.1;  // of min_coverage: black agrees with dark photos
  const bool has_photos = !std::isnan(check.median_psnr);
  return check.median_coverage < (has_photos ? kWithPhotos : 1) * options.min_coverage;
}

namespace {

std::string Mismatch(const SceneCheck& check, const SceneCheckOptions& options) {
  if (check.median_near > options.max_near) {
    return Fixed(100 * check.median_near, 0) +
           " % of the sparse points of a view are nearer to it than " +
           Fixed(double(kNearPlane), 1) +
           ", and nothing so near is drawn: scale the workspace and the splat up";
  }
  if (CoversTooLittle(check, options)) {
    return "the splat covers only " + Fixed(100 * check.median_coverage, 0) +
           " % of the views: it seems to be in another frame than the workspace; retint align "
           "finds it";
  }
  if (check.median_psnr < options.min_psnr) {
    return "renders and photos disagree (" + Fixed(check.median_psnr, 1) +
           " dB): the splat seems to be in another frame than the workspace, which retint align "
           "finds, "
           "or of another scene";
  }
  if (check.median_gain > options.max_gain) {
    return "renders fit the photos better moved by " + Fixed(100 * check.median_moved, 0) +
           " % of their size than where they are: the splat seems to lie elsewhere in the "
           "workspace's world, and retint align finds where";
  }
  return "";
}

}  // namespace

std::string WarningOfColors(const GaussianModel& model, std::span<const uint32_t> records) {
  constexpr float kMostColor = 50;
  constexpr float kMost = kMostColor / 0.28209479F;  // of a coefficient, by the basis of degree 0
  const auto is_extreme = [](float value) { return std::abs(value) > kMost; };
  const size_t block = static_cast<size_t>(model.NumShCoeffs()) * 3;
  size_t count = 0, first = 0;
  float value = 0;
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    const auto row = std::span(model.sh).subspan(g * block, block);
    const auto found = std::ranges::find_if(row, is_extreme);
    if (found == row.end()) continue;
    if (count++ > 0) continue;
    first = records.empty() ? g : records[g];
    value = *found;
  }
  if (count == 0) return {};
  char text[256];
  std::snprintf(text, sizeof text,
                "colors of %zu Gaussian%s are far outside what a display shows (Gaussian %zu has "
                "the SH coefficient %.3g), and an edit near them may go wrong: remove them from "
                "the splat",
                count, count == 1 ? "" : "s", first, double{value});
  return text;
}

std::string MismatchIn(OpenScene& scene, const std::vector<const View*>& views,
                       const SceneCheckOptions& options) {
  if (scene.workspace().has_virtual_views) return "";
  scene.renderer().SetSh(scene.original().sh);
  SceneCheck check;
  for (const View* view : views) {
    if (int(check.comparisons.size()) == options.max_views) break;
    if (scene.workspace().HasPhoto(*view)) {
      check.comparisons.push_back(Compare(scene, *view, options));
    }
  }
  TakeMedians(&check);
  SceneCheckOptions anywhere = options;
  anywhere.min_coverage = 0;
  return Mismatch(check, anywhere);
}

std::string MismatchIn(OpenScene& scene, const std::vector<std::string>& names) {
  SceneCheckOptions options;
  options.max_views = 2;
  std::vector<const View*> views;
  const Pictures pictures = scene.pictures();
  for (const std::string& name : names) {
    if (const View* view = scene.reconstruction().FindView(name)) {
      views.push_back(view);
      continue;
    }
    for (const UserPicture* picture : pictures.Require(name)) {
      views.push_back(picture->faces.front());
    }
  }
  return MismatchIn(scene, views, options);
}

std::string WarningOfMissingPhotos(const Workspace& workspace) {
  const View* first = nullptr;
  size_t missing = 0;
  const auto views = workspace.reconstruction.ViewsByName();
  for (const View* view : views) {
    if (workspace.HasPhoto(*view)) continue;
    if (missing++ == 0) first = view;
  }
  if (missing == 0) return "";
  const std::string line = std::to_string(missing) + " of " + std::to_string(views.size()) +
                           " views have no photo, and are fitted to their renders";
  return workspace.has_virtual_views ? line : line + "; there is no " + FullPath(workspace, *first);
}

SceneCheck CheckScene(OpenScene& scene, Monitor& monitor, const SceneCheckOptions& options) {
  scene.renderer().SetSh(scene.original().sh);
  return CheckScene(
      scene.workspace(), [&](const View&) -> OpenScene& { return scene; }, monitor, options);
}

SceneCheck CheckScene(const Workspace& workspace,
                      const std::function<OpenScene&(const View&)>& show, Monitor& monitor,
                      const SceneCheckOptions& options) {
  SceneCheck check;
  const std::vector<const View*> views = workspace.reconstruction.ViewsByName();
  check.views = static_cast<int>(views.size());
  for (const View* view : views) {
    if (!workspace.has_virtual_views && !workspace.HasPhoto(*view))
      check.missing_photos.push_back(view->name);
  }
  const std::vector<std::vector<const View*>> pictures = ByPicture(workspace, views);
  const int count = std::min(options.max_views, static_cast<int>(pictures.size()));
  for (int i = 0; i < count; ++i) {
    monitor.Step("check", i, count);
    const auto at = static_cast<size_t>(i) * pictures.size() / static_cast<size_t>(count);
    // Of a photo that takes several views, the one that shows most: others may look at nothing.
    ViewComparison one;
    for (const View* view : pictures[at]) {
      const ViewComparison found = Compare(show(*view), *view, options);
      if (one.view.empty() || found.coverage > one.coverage) one = found;
    }
    check.comparisons.push_back(one);
  }
  monitor.Step("check", count, count);
  TakeMedians(&check);
  if (!workspace.has_virtual_views) check.mismatch = Mismatch(check, options);
  if (!check.missing_photos.empty()) check.warnings.push_back(MissingPhotos(workspace, check));
  if (!check.mismatch.empty()) check.warnings.push_back(check.mismatch);
  return check;
}

}  // namespace retint
