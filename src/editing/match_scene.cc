// SPDX-License-Identifier: BSD-3-Clause
#include "editing/match_scene.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/median.h"
#include "base/option_name.h"
#include "colmap_io/image_io.h"
#include "opening/render_model.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kCells = 128;         // along the longer side of a view
constexpr float kOpaque = 0.95F;    // alpha
constexpr float kClipped = 0.985F;  // of a photo
constexpr float kSameDepth = 0.02F;
constexpr double kSameFrame = 0.25;  // of the pixels that two splats cover, at the same depth
constexpr double kValid = 0.9;       // of a cell's pixels

// The pixels that are compared: 255.
Mask ValidPixels(const RenderOutput& render) {
  Mask valid(render.rgb.width, render.rgb.height);
  for (size_t i = 0; i < valid.data.size(); ++i) {
    valid.data[i] = render.alpha.data[i] > kOpaque ? 255 : 0;
  }
  return valid;
}

// Pixels inside a photo's reach and below its clipping.
void KeepUnclipped(const Image& photo, const Mask& reach, Mask* valid) {
  for (size_t i = 0; i < valid->data.size(); ++i) {
    const float most = *std::max_element(&photo.data[3 * i], &photo.data[3 * i] + 3);
    if (most > kClipped || (!reach.Empty() && reach.data[i] == 0)) valid->data[i] = 0;
  }
}

// Pixels that both splats cover, and those of them at the same depth.
struct Overlap {
  int64_t both = 0, same = 0;
};

void KeepSameDepth(const RenderOutput& a, const RenderOutput& b, Mask* valid, Overlap* overlap) {
  for (size_t i = 0; i < valid->data.size(); ++i) {
    const float depth = a.depth_median.data[i], other = b.depth_median.data[i];
    const bool both = valid->data[i] != 0 && b.alpha.data[i] > kOpaque;
    const bool same = both && std::abs(depth - other) < kSameDepth * depth;
    overlap->both += both ? 1 : 0;
    overlap->same += same ? 1 : 0;
    if (!same) valid->data[i] = 0;
  }
}

void AddCells(const Image& from, const Image& to, const Mask& valid, MatchView* view) {
  const int side = std::max(1, (std::max(from.width, from.height) + kCells - 1) / kCells);
  for (int top = 0; top + side <= from.height; top += side) {
    for (int left = 0; left + side <= from.width; left += side) {
      Vector3d sums[2] = {Vector3d::Zero(), Vector3d::Zero()};
      int count = 0;
      for (int y = top; y < top + side; ++y) {
        for (int x = left; x < left + side; ++x) {
          if (valid(x, y) == 0) continue;
          ++count;
          for (int c = 0; c < 3; ++c) {
            sums[0][c] += double(from(x, y, c));
            sums[1][c] += double(to(x, y, c));
          }
        }
      }
      if (count < kValid * side * side) continue;
      for (int c = 0; c < 3; ++c) {
        view->from.push_back(float(sums[0][c] / count));
        view->to.push_back(float(sums[1][c] / count));
      }
    }
  }
}

using Corners = std::array<cv::Point2f, 4>;

Corners CornersOf(const CardInPhoto& card) {
  Corners corners;
  const auto& p = card.place;
  for (size_t i = 0; i < 4; ++i) {
    const bool right = i == 1 || i == 2, below = i >= 2;
    const double x = p.size() == 8 ? p[2 * i] : p[0] + (right ? p[2] : 0);
    const double y = p.size() == 8 ? p[2 * i + 1] : p[1] + (below ? p[3] : 0);
    corners[i] = cv::Point2f(float(x), float(y));
  }
  return corners;
}

// From the unit square, whose corners (0,0), (1,0), (1,1), (0,1) become those of the card.
cv::Matx33d PlaceOf(const Corners& corners) {
  const Corners unit = {cv::Point2f(0, 0), {1, 0}, {1, 1}, {0, 1}};
  return cv::getPerspectiveTransform(unit.data(), corners.data());
}

// Median color of a part of the unit square, and how far the middle eight tenths spread at most.
struct PatchColor {
  Vector3d color;
  double spread = 0;
};

PatchColor ColorOf(const Image& photo, const cv::Matx33d& place, const Vector2d& least,
                   const Vector2d& most) {
  constexpr int kSamples = 48;  // a side
  std::vector<double> values[3];
  for (int i = 0; i < kSamples * kSamples; ++i) {
    const Vector2d share((i % kSamples + 0.5) / kSamples, (double(i / kSamples) + 0.5) / kSamples);
    const Vector2d from = least + share.cwiseProduct(most - least);
    const cv::Vec3d at = place * cv::Vec3d(from.x(), from.y(), 1);
    const int x = std::clamp(int(at[0] / at[2]), 0, photo.width - 1);
    const int y = std::clamp(int(at[1] / at[2]), 0, photo.height - 1);
    for (int c = 0; c < 3; ++c) values[c].push_back(double(photo(x, y, c)));
  }
  PatchColor found;
  for (int c = 0; c < 3; ++c) {
    found.color[c] = Median(values[c]);
    found.spread = std::max(found.spread, Quantile(values[c], 0.9) - Quantile(values[c], 0.1));
  }
  return found;
}

std::string Named(const CardInPhoto& card, const char* option) {
  std::string text;
  for (const double value : card.place)
    text += fmt::format("{}{:g}", text.empty() ? "" : ",", value);
  return fmt::format("{} {}:{}", OptionName(option), card.view, text);
}

const View& ViewOf(const OpenScene& scene, const CardInPhoto& card) {
  return *scene.pictures().RequireOne(card.view).faces.front();
}

Image PhotoOf(const OpenScene& scene, const CardInPhoto& card, const char* option) {
  constexpr int kLeastArea = 16;
  const View& view = ViewOf(scene, card);
  if (!scene.workspace().HasPhoto(view)) {
    throw InputError(Named(card, option) + ": the view has no photo");
  }
  Image photo = ReadImage(scene.workspace().PhotoPath(view));
  const Corners corners = CornersOf(card);
  for (const auto& [x, y] : corners) {
    if (x >= 0 && y >= 0 && x <= float(photo.width) && y <= float(photo.height)) continue;
    throw InputError(fmt::format("{}: lies outside the photo, which has {}x{} pixels",
                                 Named(card, option), photo.width, photo.height));
  }
  if (!cv::isContourConvex(corners) || cv::contourArea(corners) < kLeastArea) {
    throw InputError(
        fmt::format("{}: name the corners in turn around an area of at least {} pixels",
                    Named(card, option), kLeastArea));
  }
  return photo;
}

MatchReference ReferenceOfGray(const OpenScene& scene, const CardInPhoto& card) {
  constexpr double kMargin = 0.05, kDark = 0.04, kUneven = 0.15;
  const Image photo = PhotoOf(scene, card, "gray");
  const PatchColor gray = ColorOf(photo, PlaceOf(CornersOf(card)), Vector2d::Constant(kMargin),
                                  Vector2d::Constant(1 - kMargin));
  const std::string named = Named(card, "gray");
  if (gray.spread > kUneven) {
    throw InputError(named + ": shows several colors; mark only the card, without its edge");
  }
  if (gray.color.maxCoeff() > double(kClipped) || gray.color.minCoeff() < kDark) {
    throw InputError(named + ": is too bright or too dark in this photo to say its color");
  }
  return {ViewOf(scene, card).name, CorrectionOfGray(gray.color)};
}

CheckerFit FitCheckerIn(const OpenScene& scene, const CardInPhoto& card) {
  constexpr double kMargin = 0.3;       // of a patch, on each side
  constexpr double kRecognized = 10.0;  // DeltaE00, mean
  const Image photo = PhotoOf(scene, card, "checker");
  Corners corners = CornersOf(card);
  std::optional<CheckerFit> best;
  for (int turn = 0; turn < 4; ++turn) {
    std::ranges::rotate(corners, corners.begin() + 1);
    const cv::Matx33d place = PlaceOf(corners);
    std::vector<float> patches;
    for (int i = 0; i < 24; ++i) {
      const Vector2d cell(1.0 / 6, 1.0 / 4), first(i % 6, double(i / 6));
      const Vector3d color =
          ColorOf(photo, place, (first + Vector2d::Constant(kMargin)).cwiseProduct(cell),
                  (first + Vector2d::Constant(1 - kMargin)).cwiseProduct(cell))
              .color;
      for (int c = 0; c < 3; ++c) patches.push_back(float(color[c]));
    }
    const std::optional<CheckerFit> fit = FitChecker(patches);
    if (fit && (!best || fit->after < best->after)) best = fit;
  }
  if (!best || best->after > kRecognized) {
    throw InputError(
        Named(card, "checker") + ": no ColorChecker of 24 patches is recognized there" +
        (best ? fmt::format(" (its patches would be off by {:.1f} DeltaE00)", best->after)
              : " (most patches are clipped)"));
  }
  return *best;
}

void RequirePhotos(const OpenScene& scene) {
  const auto photos = std::ranges::count_if(
      scene.views(), [&](const View* view) { return scene.workspace().HasPhoto(*view); });
  if (photos >= 2) return;
  throw InputError(fmt::format(
      "{} of {} views have a photo, and a match needs two. {} names the folder of the photos; {} "
      "matches another splat instead",
      photos, scene.views().size(), OptionName("images"), OptionName("like")));
}

std::vector<MatchView> CompareViews(EditSession& session, const GaussianModel* like,
                                    Monitor& monitor) {
  OpenScene& scene = session.scene();
  std::unique_ptr<Renderer> other;
  if (like) {
    other = std::make_unique<Renderer>(scene.renderer().shared_backend(), *like,
                                       RendererOptions{.cache_bytes = 0});
  }
  const RenderRequest request{.depth_median = like != nullptr, .alpha = true, .cache = false};
  constexpr size_t kHoldout = 4;
  const auto& heldout = scene.heldout_views();
  const auto is_heldout = [&](size_t v) {
    if (heldout.empty()) return v % kHoldout == 0;
    return std::find(heldout.begin(), heldout.end(), scene.views()[v]) != heldout.end();
  };
  std::vector<MatchView> compared;
  Overlap overlap;
  for (size_t v = 0; v < scene.views().size(); ++v) {
    monitor.Step("match", double(v), double(scene.views().size()));
    const View& view = *scene.views()[v];
    if (!like && !scene.workspace().HasPhoto(view)) continue;
    const PosedCamera camera = scene.reconstruction().Posed(view);
    const RenderOutput render = scene.renderer().Render(camera, request);
    Image to;
    Mask valid = ValidPixels(render);
    if (like) {
      RenderOutput wanted = other->Render(camera, request);
      KeepSameDepth(render, wanted, &valid, &overlap);
      to = std::move(wanted.rgb);
    } else {
      to = scene.workspace().ReadPhoto(view);
      const bool distorted = scene.workspace().PhotoOf(view) != nullptr;
      KeepUnclipped(to, distorted ? scene.workspace().photo_pixels->Reach(view.id) : Mask(),
                    &valid);
    }
    MatchView one{view.name, is_heldout(v), {}, {}};
    AddCells(render.rgb, to, valid, &one);
    compared.push_back(std::move(one));
  }
  monitor.Step("match", 1, 1);
  const double same = double(overlap.same) / double(std::max<int64_t>(overlap.both, 1));
  if (like && same < kSameFrame) {
    throw InputError(fmt::format(
        "{}: only {:.0f} % of the pixels that both splats cover have the same depth. Bring that "
        "splat into the workspace's frame with `retint align`",
        OptionName("like"), 100 * same));
  }
  return compared;
}

}  // namespace

CardInPhoto ParseCard(std::string_view option, std::string_view text) {
  CardInPhoto card;
  const size_t colon = text.rfind(':');
  bool good = colon != std::string_view::npos && colon > 0;
  if (good) {
    card.view = text.substr(0, colon);
    const char* at = text.data() + colon + 1;
    const char* const end = text.data() + text.size();
    while (good) {
      double value = 0;
      const auto [next, code] = std::from_chars(at, end, value);
      good = code == std::errc() && std::isfinite(value);
      card.place.push_back(value);
      at = next;
      if (at == end) break;
      good = good && *at++ == ',';
    }
    good = good && (card.place.size() == 8 ||
                    (card.place.size() == 4 && card.place[2] > 0 && card.place[3] > 0));
  }
  CheckOption(good, fmt::format("{} is VIEW:X,Y,WIDTH,HEIGHT or VIEW: and four corners "
                                "X1,Y1,...,X4,Y4, in pixels of the photo, not {}",
                                OptionName(option), text));
  return card;
}

void MatchRecipe::Check() const {
  const bool known = map == "auto" || (map != "none" && MatchMapNamed(map));
  CheckOption(known, fmt::format("{} is auto, exposure, balance, matrix or table, not {}",
                                 OptionName("map"), map));
  if (!gray.empty()) ParseCard("gray", gray);
  if (!checker.empty()) ParseCard("checker", checker);
  CheckOption(!like.empty() + !gray.empty() + !checker.empty() <= 1,
              fmt::format("only one of {}, {} and {} can be the reference", OptionName("like"),
                          OptionName("gray"), OptionName("checker")));
}

SceneMatch MatchByRecipe(EditSession& session, const MatchRecipe& recipe, Monitor& monitor) {
  recipe.Check();
  SceneMatchRequest request;
  request.map = MatchMapNamed(recipe.map);
  if (!recipe.gray.empty()) request.gray = ParseCard("gray", recipe.gray);
  if (!recipe.checker.empty()) request.checker = ParseCard("checker", recipe.checker);
  GaussianModel like;
  if (!recipe.like.empty()) {
    like = ReadSplat(recipe.like, monitor);
    ChooseRenderModel({}, recipe.like, {}, like);
    request.like = &like;
    request.target = recipe.like.filename().string();
  }
  return MatchScene(session, request, monitor);
}

SceneMatch MatchScene(EditSession& session, const SceneMatchRequest& request, Monitor& monitor) {
  OpenScene& scene = session.scene();
  if (!request.like) RequirePhotos(scene);
  SceneMatch match;
  MatchOptions options{.map = request.map, .reference = {}};
  if (request.gray) options.reference = ReferenceOfGray(scene, *request.gray);
  if (request.checker) {
    match.checker = FitCheckerIn(scene, *request.checker);
    options.reference = {ViewOf(scene, *request.checker).name, match.checker->correction};
  }
  scene.renderer().SetSh(session.refits().CurrentSh());
  const std::vector<MatchView> views = CompareViews(session, request.like, monitor);
  match.colors = MatchColors(views, options);
  match.sentences = SentencesOf(match.colors, request.target);
  const size_t all = scene.views().size(), compared = match.colors.views.size();
  if (compared < all) {
    match.warning = fmt::format(
        "{} of {} views do not count: they have no photo, or too few pixels that can be compared",
        all - compared, all);
  }
  return match;
}

RegionId ApplyMatch(EditSession& session, const ColorMatch& match, const std::string& name,
                    Monitor& monitor) {
  OpenScene& scene = session.scene();
  std::map<std::string, Mask> masks;
  for (const View* view : scene.views()) {
    const Camera& camera = scene.reconstruction().cameras.at(view->camera_id);
    masks[view->name] = Mask(camera.width, camera.height, 255);
  }
  return session.store().Add(name, std::move(masks),
                             std::vector<float>(scene.original().NumGaussians(), 1.0F), match.edit,
                             monitor);
}

}  // namespace retint
