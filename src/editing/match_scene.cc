// SPDX-License-Identifier: BSD-3-Clause
#include "editing/match_scene.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <Eigen/LU>

#include "base/error.h"
#include "base/median.h"
#include "base/option_name.h"
#include "colmap_io/image_io.h"

namespace retint {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kCells = 128;         // along the longer side of a view
constexpr float kOpaque = 0.95F;    // alpha
constexpr float kClipped = 0.985F;  // of a photo
constexpr float kSameDepth = 0.02F;
constexpr double kValid = 0.9;  // of a cell's pixels

// The pixels that are compared: 255.
Mask ValidPixels(const RenderOutput& render, const Image& to) {
  Mask valid(to.width, to.height);
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

void KeepSameDepth(const RenderOutput& a, const RenderOutput& b, Mask* valid) {
  for (size_t i = 0; i < valid->data.size(); ++i) {
    const float depth = a.depth_median.data[i], other = b.depth_median.data[i];
    const bool same = depth > 0 && std::abs(depth - other) < kSameDepth * depth;
    if (!same || b.alpha.data[i] <= kOpaque) valid->data[i] = 0;
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

// Points of the unit square to points of a photo: the projective map of its corners
// (0,0), (1,0), (1,1), (0,1) to `corners`.
class Place {
 public:
  explicit Place(const std::array<Vector2d, 4>& corners) {
    const Vector2d unit[4] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    Eigen::Matrix<double, 8, 8> system = Eigen::Matrix<double, 8, 8>::Zero();
    Eigen::Matrix<double, 8, 1> right;
    for (int i = 0; i < 4; ++i) {
      const Vector2d& to = corners[size_t(i)];
      for (int c = 0; c < 2; ++c) {
        system.block<1, 3>(2 * i + c, 3 * c) = unit[i].homogeneous().transpose();
        system.block<1, 2>(2 * i + c, 6) = -to[c] * unit[i].transpose();
        right[2 * i + c] = to[c];
      }
    }
    const Eigen::Matrix<double, 8, 1> h = system.fullPivLu().solve(right);
    map_ << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  }
  Vector2d operator()(const Vector2d& at) const { return (map_ * at.homogeneous()).hnormalized(); }

 private:
  Eigen::Matrix3d map_;
};

std::array<Vector2d, 4> CornersOf(const CardInPhoto& card) {
  const auto& p = card.place;
  if (p.size() == 8) {
    return {Vector2d(p[0], p[1]), Vector2d(p[2], p[3]), Vector2d(p[4], p[5]), Vector2d(p[6], p[7])};
  }
  return {Vector2d(p[0], p[1]), Vector2d(p[0] + p[2], p[1]), Vector2d(p[0] + p[2], p[1] + p[3]),
          Vector2d(p[0], p[1] + p[3])};
}

// Median color of a part of the unit square, and how far the middle eighth tenths spread at most.
struct PatchColor {
  Vector3d color;
  double spread = 0;
};

PatchColor ColorOf(const Image& photo, const Place& place, const Vector2d& least,
                   const Vector2d& most) {
  constexpr int kSamples = 48;  // a side
  std::vector<double> values[3];
  for (int i = 0; i < kSamples * kSamples; ++i) {
    const Vector2d share((i % kSamples + 0.5) / kSamples, (double(i / kSamples) + 0.5) / kSamples);
    const Vector2d at = place(least + share.cwiseProduct(most - least));
    const int x = std::clamp(int(at.x()), 0, photo.width - 1);
    const int y = std::clamp(int(at.y()), 0, photo.height - 1);
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
  const View& view = ViewOf(scene, card);
  if (!scene.workspace().HasPhoto(view)) {
    throw InputError(Named(card, option) + ": the view has no photo");
  }
  Image photo = ReadImage(scene.workspace().PhotoPath(view));
  for (const Vector2d& corner : CornersOf(card)) {
    const bool inside = corner.x() >= 0 && corner.y() >= 0 && corner.x() <= photo.width &&
                        corner.y() <= photo.height;
    if (inside) continue;
    throw InputError(fmt::format("{}: lies outside the photo, which has {}x{} pixels",
                                 Named(card, option), photo.width, photo.height));
  }
  return photo;
}

MatchReference ReferenceOfGray(const OpenScene& scene, const CardInPhoto& card) {
  constexpr double kMargin = 0.05, kDark = 0.04, kUneven = 0.15;
  const Image photo = PhotoOf(scene, card, "gray");
  const PatchColor gray = ColorOf(photo, Place(CornersOf(card)), Vector2d::Constant(kMargin),
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
  const std::array<Vector2d, 4> corners = CornersOf(card);
  std::optional<CheckerFit> best;
  for (size_t turn = 0; turn < 4; ++turn) {
    std::array<Vector2d, 4> turned;
    for (size_t i = 0; i < 4; ++i) turned[i] = corners[(i + turn) % 4];
    const Place place(turned);
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

std::vector<MatchView> CompareViews(EditSession& session, const GaussianModel* like,
                                    Monitor& monitor) {
  OpenScene& scene = session.scene();
  std::unique_ptr<Renderer> other;
  if (like) {
    other = std::make_unique<Renderer>(scene.renderer().shared_backend(), *like,
                                       RendererOptions{.cache_bytes = 0});
  }
  const RenderRequest request{.depth_median = like != nullptr, .alpha = true, .cache = false};
  const auto& heldout = scene.heldout_views();
  std::vector<MatchView> compared;
  for (size_t v = 0; v < scene.views().size(); ++v) {
    monitor.Step("match", double(v), double(scene.views().size()));
    const View& view = *scene.views()[v];
    if (!like && !scene.workspace().HasPhoto(view)) continue;
    const PosedCamera camera = scene.reconstruction().Posed(view);
    const RenderOutput render = scene.renderer().Render(camera, request);
    Image to;
    Mask valid = ValidPixels(render, render.rgb);
    if (like) {
      RenderOutput wanted = other->Render(camera, request);
      KeepSameDepth(render, wanted, &valid);
      to = std::move(wanted.rgb);
    } else {
      to = scene.workspace().ReadPhoto(view);
      const bool distorted = scene.workspace().PhotoOf(view) != nullptr;
      KeepUnclipped(to, distorted ? scene.workspace().photo_pixels->Reach(view.id) : Mask(),
                    &valid);
    }
    MatchView one{
        view.name, std::find(heldout.begin(), heldout.end(), &view) != heldout.end(), {}, {}};
    AddCells(render.rgb, to, valid, &one);
    compared.push_back(std::move(one));
  }
  monitor.Step("match", 1, 1);
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

SceneMatch MatchScene(EditSession& session, const SceneMatchRequest& request, Monitor& monitor) {
  CheckOption(
      !(request.gray && request.checker) && (!request.like || (!request.gray && !request.checker)),
      fmt::format("only one of {}, {} and {} can be the reference", OptionName("like"),
                  OptionName("gray"), OptionName("checker")));
  OpenScene& scene = session.scene();
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
  return match;
}

void ApplyMatch(EditSession& session, const ColorMatch& match, const RefitJob& job,
                Monitor& monitor) {
  OpenScene& scene = session.scene();
  const auto add = [&](const char* name, ColorEdit edit) {
    std::map<std::string, Mask> masks;
    for (const View* view : scene.views()) {
      const Camera& camera = scene.reconstruction().cameras.at(view->camera_id);
      masks[view->name] = Mask(camera.width, camera.height, 255);
    }
    session.store().Add(name, std::move(masks),
                        std::vector<float>(scene.original().NumGaussians(), 1.0F), edit, monitor);
  };
  ColorEdit matrix = match.edit, table;
  if (match.map == MatchMap::kTable) {
    table.operations.push_back(matrix.operations.back());
    matrix.operations.pop_back();
  }
  add("match", matrix);
  if (match.map != MatchMap::kTable) return;
  add("match table", table);
  session.refits().Refit(job, monitor);
}

}  // namespace retint
