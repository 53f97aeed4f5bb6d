// SPDX-License-Identifier: BSD-3-Clause
// Paint on one view of a plane, compared with the known result in the other views, and its
// visibility before a fit.
#include "recolor/paint_carrier.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <gtest/gtest.h>

#include "base/error.h"
#include "kernels/common/color_spaces.h"
#include "tests/recolor/tiny_scene.h"

namespace retint {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kHalf = 0.9;  // of the plane that tests look at, which is a little larger
constexpr double kSpacing = 0.04;

PosedCamera CameraAt(double azimuth) {
  PosedCamera view = LookAtOrigin(azimuth, 4.0, kWidth, kHeight);
  view.camera = Camera::Pinhole(1, kWidth, kHeight, 170, 170, kWidth / 2.0, kHeight / 2.0);
  return view;
}

struct Patch {
  double half, z;
  Vector3f color;
  double opacity_logit = 5;
};

// Squares of flat Gaussians across the z axis.
GaussianModel Squares(const std::vector<Patch>& patches) {
  struct Disc {
    Vector3d center;
    Patch patch;
  };
  std::vector<Disc> discs;
  for (const Patch& patch : patches) {
    const int count = int(std::lround(2 * patch.half / kSpacing)) + 1;
    for (int i = 0; i < count * count; ++i) {
      discs.push_back(
          {{i % count * kSpacing - patch.half, i / count * kSpacing - patch.half, patch.z}, patch});
    }
  }
  GaussianModel model;
  model.Resize(discs.size(), 1);
  std::fill(model.sh.begin(), model.sh.end(), 0.0f);
  for (size_t g = 0; g < discs.size(); ++g) {
    SetGaussian(model, g, discs[g].center, 0.7 * kSpacing, discs[g].patch.opacity_logit);
    model.log_scales[3 * g + 2] = float(std::log(1e-3));
    for (int c = 0; c < 3; ++c) {
      model.sh[g * 12 + size_t(c)] = (discs[g].patch.color[c] - 0.5f) / 0.28209479f;
    }
  }
  return model;
}

// Where the ray through a position of a view meets the plane z = 0.
Vector3d OnPlane(const PosedCamera& view, double x, double y) {
  const Vector3d center = view.Center(), ray = view.Unproject({x, y}, 1) - center;
  return center - ray * (center.z() / ray.z());
}

const Vector3f kDark(0.2f, 0.25f, 0.6f), kLight(0.8f, 0.75f, 0.3f);

// Stripes, a pixel's mean.
Vector3f Stripes(const PosedCamera& view, int x, int y) {
  Vector3f sum = Vector3f::Zero();
  for (int i = 0; i < 64; ++i) {
    const Vector3d at = OnPlane(view, x + (i % 8 + 0.5) / 8, y + (i / 8 + 0.5) / 8);
    sum += int(std::floor(at.x() / 0.45)) % 2 == 0 ? kDark : kLight;
  }
  return sum / 64;
}

bool IsInside(const PosedCamera& view, int x, int y) {
  const Vector3d at = OnPlane(view, x + 0.5, y + 0.5);
  return std::max(std::abs(at.x()), std::abs(at.y())) < kHalf;
}

Mask InsideMask(const PosedCamera& view) {
  Mask mask(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) mask(x, y) = IsInside(view, x, y) ? 255 : 0;
  }
  return mask;
}

template <typename Color>
PaintLayer PaintOf(const PosedCamera& view, const Color& color) {
  PaintLayer layer{"painted", 0, 0, Image8(kWidth, kHeight), InsideMask(view)};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Vector3f value = color(x, y);
      for (int c = 0; c < 3; ++c) layer.color(x, y, c) = uint8_t(std::lround(255 * value[c]));
    }
  }
  return layer;
}

ColorEdit EditOf(std::vector<PaintLayer> layers) {
  ColorOperation op = ColorOperation::Picture({});
  op.picture = std::make_shared<PictureEdit>(PictureEdit{{}, std::move(layers)});
  op.Get("explained")[0] = 0;
  op.Get("residual")[0] = 0;
  return {{op}, 1};
}

struct Scene {
  explicit Scene(const std::vector<Patch>& patches)
      : model(Squares(patches)), renderer(CreateBackend("cpu"), model) {}
  GaussianModel model;
  Renderer renderer;
};

TEST(PaintedEditTest, WhatIsNotPaintedTakesTheWholeList) {
  ColorEdit edit = EditOf({PaintLayer{"painted", 0, 0, Image8(1, 1), Mask(1, 1)}});
  edit.operations.insert(
      edit.operations.begin(),
      ColorOperation::Make(ColorOperationKind::kRecolor, {1, 1, 1, 0, 0.6f, 0.4f, 0.2f, 1.5f}));
  edit.operations.push_back(ColorOperation::Make(ColorOperationKind::kSoftClip));
  const PaintedEdit painted(edit);
  const CompiledEdit whole(edit);
  for (const float light : {0.3f, 0.8f, 1.0f, 1.2f, 1.6f}) {
    const Vector3f color = light * Vector3f(0.6f, 0.4f, 0.2f);
    EXPECT_EQ(painted.Apply(color, kDark, 0), whole.Apply(color)) << light;
  }
}

// Position along a row at which the red channel falls or rises through the middle of the stripes,
// from pixel `x` on; -1 where it does not.
double NextEdge(const Image& image, int y, int x) {
  const float middle = (kDark[0] + kLight[0]) / 2;
  for (; x + 1 < kWidth; ++x) {
    const float a = image(x, y) - middle, b = image(x + 1, y) - middle;
    if (a * b <= 0 && a != b) return x + 0.5 + double(a / (a - b));
  }
  return -1;
}

// Stripes that are carried to another view, against the true ones; pixels at the square's border
// aside, which it covers only in part.
void ExpectStripesInPlace(Scene& scene) {
  const PosedCamera painted = CameraAt(0.1), other = CameraAt(-0.4);
  const ColorEdit edit =
      EditOf({PaintOf(painted, [&](int x, int y) { return Stripes(painted, x, y); })});
  ASSERT_TRUE(edit.HasPaint());
  PaintCarrier carrier(edit, {painted}, scene.model);
  const Mask mask = InsideMask(other);
  const Image target = carrier.Target(scene.renderer, other, mask, nullptr);
  Image truth = target;
  double squares = 0;
  int count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (mask(x, y) == 0) continue;
      const Vector3f expected = Stripes(other, x, y);
      const bool whole = IsInside(other, x - 2, y) && IsInside(other, x + 2, y) &&
                         IsInside(other, x, y - 2) && IsInside(other, x, y + 2);
      for (int c = 0; c < 3; ++c) {
        truth(x, y, c) = expected[c];
        const double error = double(target(x, y, c)) - double(expected[c]);
        if (whole) squares += error * error, ++count;
      }
    }
  }
  ASSERT_GT(count, 1000);
  // Paint at the mean depth has 29 dB, because surfaces behind it move that depth.
  EXPECT_GT(-10 * std::log10(squares / count), 33);
  int edges = 0;
  for (int y = kHeight / 2 - 20; y <= kHeight / 2 + 20; y += 10) {
    for (double at = NextEdge(truth, y, 55); at > 0 && at < 105;
         at = NextEdge(truth, y, int(at) + 3), ++edges) {
      EXPECT_NEAR(NextEdge(target, y, int(at) - 4), at, 1.0) << y;
    }
  }
  EXPECT_GE(edges, 10);
}

TEST(PaintCarrierTest, StripesLieWhereTheyAreInTheOtherView) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  ExpectStripesInPlace(scene);
}

// A surface lets a little of the light behind it through. That must not move its paint.
TEST(PaintCarrierTest, WhatShinesThroughDoesNotMoveThePaint) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}, 3}, {3.0, 6.0, {0.5f, 0.5f, 0.5f}}});
  ExpectStripesInPlace(scene);
}

TEST(PaintCarrierTest, NeedsTheCamerasOfAllLayers) {
  Scene scene({{0.2, 0, {0.5f, 0.5f, 0.5f}}});
  const PosedCamera view = CameraAt(0);
  const ColorEdit edit = EditOf({PaintOf(view, [](int, int) { return kDark; })});
  const std::shared_ptr<const PictureEdit> picture = edit.operations[0].picture;
  for (const std::vector<PosedCamera>& cameras :
       {std::vector<PosedCamera>{}, std::vector<PosedCamera>{view, view}}) {
    EXPECT_THROW(PaintCarrier(edit, cameras, scene.model), OptionError);
    EXPECT_THROW(FindGaussianPaint(scene.renderer, scene.model, picture, cameras), OptionError);
  }
}

TEST(PaintCarrierTest, WhatThePaintedViewDoesNotSeeStays) {
  // A small square in front of the large one hides some of it.
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}, {0.2, -1.5, {0.3f, 0.3f, 0.3f}}});
  const PosedCamera painted = CameraAt(0.0), other = CameraAt(0.5);
  const Vector3f red(0.9f, 0.1f, 0.1f);
  PaintCarrier carrier(EditOf({PaintOf(painted, [&](int, int) { return red; })}), {painted},
                       scene.model);
  const Mask whole(kWidth, kHeight, 255);
  const Image target = carrier.Target(scene.renderer, other, whole, nullptr);
  const Image before = scene.renderer.Render(other).rgb;
  const auto at = [&](const Vector3d& point) {
    const Vector3d pixel = other.Project(point).value();
    return other.camera.width > 0 ? std::pair{int(pixel.x()), int(pixel.y())} : std::pair{0, 0};
  };
  // The middle of the large square, behind the small one in the painted view, and free here.
  const auto [hidden_x, hidden_y] = at({0, 0, 0});
  EXPECT_NEAR(target(hidden_x, hidden_y), before(hidden_x, hidden_y), 1e-5f);
  // A part that both see, and the small square itself.
  for (const Vector3d& point : {Vector3d(0.7, 0.6, 0), Vector3d(0, 0, -1.5)}) {
    const auto [x, y] = at(point);
    // The light is compared over some pixels, and the render is as even as its Gaussians.
    EXPECT_NEAR(target(x, y, 0), red[0], 0.05f);
    EXPECT_NEAR(target(x, y, 1), red[1], 0.05f);
  }
}

TEST(PaintCarrierTest, LightMovesWithTheViewer) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  // Brighter from one side: the coefficients of x.
  for (size_t g = 0; g < scene.model.NumGaussians(); ++g) {
    for (size_t c = 0; c < 3; ++c) scene.model.sh[g * 12 + 9 + c] = 0.3f;
  }
  scene.renderer.SetSh(scene.model.sh);
  const PosedCamera painted = CameraAt(0.0), other = CameraAt(-0.5);
  const Vector3f blue(0.1f, 0.2f, 0.5f);
  PaintCarrier carrier(EditOf({PaintOf(painted, [&](int, int) { return blue; })}), {painted},
                       scene.model);
  const Image target = carrier.Target(scene.renderer, other, InsideMask(other), nullptr);
  const Image here = scene.renderer.Render(other).rgb, there = scene.renderer.Render(painted).rgb;
  const int x = kWidth / 2, y = kHeight / 2;
  const float ratio = LinearFromSrgb(here(x, y)) / LinearFromSrgb(there(x, y));
  ASSERT_GT(std::abs(ratio - 1), 0.1f);
  for (int c = 0; c < 3; ++c) {
    // Colors are even here; eight bits of the paint, and the mean over some pixels.
    EXPECT_NEAR(LinearFromSrgb(target(x, y, c)), ratio * LinearFromSrgb(blue[c]), 0.01f);
  }
}

// A layer's own view shows the paint itself.
TEST(PaintCarrierTest, ThePaintedViewShowsItsPicture) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  const PosedCamera painted = CameraAt(0.2);
  const PaintLayer layer = PaintOf(painted, [&](int x, int y) { return Stripes(painted, x, y); });
  PaintCarrier carrier(EditOf({layer}), {painted}, scene.model);
  const Mask mask = InsideMask(painted);
  const Image target = carrier.Target(scene.renderer, painted, mask, nullptr);
  for (size_t i = 0; i < target.data.size(); ++i) {
    if (mask.data[i / 3] == 0) continue;
    EXPECT_NEAR(target.data[i], float(layer.color.data[i]) / 255, 1e-3f);  // rounding of positions
  }
}

// The pixel's own edit decides which colors leave the gamut. Paint covers colors that were too
// bright before it, and later operations can make it too bright.
TEST(PaintCarrierTest, TellsWhichColorsLeaveTheGamut) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  const PosedCamera painted = CameraAt(0.0);
  PaintLayer layer = PaintOf(painted, [](int, int) { return Vector3f(0.2f, 0.3f, 0.4f); });
  for (int y = 0; y < kHeight; ++y) {
    for (int x = kWidth / 2; x < kWidth; ++x) layer.alpha(x, y) = 0;
  }
  const ColorOperation brighter = ColorOperation::Make(ColorOperationKind::kExposure, {4});
  const Mask mask = InsideMask(painted);
  for (const bool first : {true, false}) {
    ColorEdit edit = EditOf({layer});
    edit.operations.insert(first ? edit.operations.begin() : edit.operations.end(), brighter);
    PaintCarrier carrier(edit, {painted}, scene.model);
    Mask leaves;
    carrier.Target(scene.renderer, painted, mask, nullptr, &leaves);
    int wrong = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool too_bright = mask(x, y) && !(first && x < kWidth / 2);
        wrong += (leaves(x, y) > 0) != too_bright;
      }
    }
    EXPECT_LT(wrong, 3 * kHeight) << first;  // the paint's border
  }
}

Mask SquareMask(const PosedCamera& view, double half) {
  Mask mask(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Vector3d at = OnPlane(view, x + 0.5, y + 0.5);
      mask(x, y) = std::max(std::abs(at.x()), std::abs(at.y())) < half ? 255 : 0;
    }
  }
  return mask;
}

// At the end of the selection, the depth is often that of the surface behind.
TEST(PaintCarrierTest, PaintReachesTheEndOfTheSelection) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}, {3.0, 2.0, {0.5f, 0.5f, 0.5f}}});
  const PosedCamera painted = CameraAt(0.0), other = CameraAt(0.3);
  const Vector3f red(0.9f, 0.1f, 0.1f);
  PaintLayer layer = PaintOf(painted, [&](int, int) { return red; });
  layer.alpha = SquareMask(painted, 1.12);
  PaintCarrier carrier(EditOf({layer}), {painted}, scene.model);
  const Mask mask =
      SquareMask(other, 1.07);  // a little farther than the square's own depth reaches
  const Image target = carrier.Target(scene.renderer, other, mask, nullptr);
  RenderRequest request;
  request.depth_median = true;
  const DepthMap depth = scene.renderer.Render(other, request).depth_median;
  int behind = 0, red_pixels = 0;
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (mask.data[p] == 0 || depth.data[p] < 5) continue;
    ++behind;
    red_pixels += target.data[3 * p] - target.data[3 * p + 1] > 0.4f ? 1 : 0;
  }
  EXPECT_GT(behind, 50);
  EXPECT_GT(red_pixels, 0.8 * behind);  // not at corners
}

// Gaussians at different depths, as fur has them: none of them is left out.
TEST(PaintCarrierTest, RoughSurfacesHaveNoHoles) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  GaussianModel rough = scene.model;
  for (size_t g = 0; g < rough.NumGaussians(); ++g) {
    rough.means[3 * g + 2] += 0.12f * float(int(g * 7 % 11) - 5) / 5;
  }
  Renderer renderer(CreateBackend("cpu"), rough);
  const PosedCamera painted = CameraAt(0.0), other = CameraAt(0.5);
  const Vector3f red(0.9f, 0.1f, 0.1f);
  PaintCarrier carrier(EditOf({PaintOf(painted, [&](int, int) { return red; })}), {painted}, rough);
  const Mask mask = SquareMask(other, 0.7);
  const Image target = carrier.Target(renderer, other, mask, nullptr);
  int inside = 0, painted_pixels = 0;
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (mask.data[p] == 0) continue;
    ++inside;
    painted_pixels += target.data[3 * p] - target.data[3 * p + 1] > 0.4f ? 1 : 0;
  }
  ASSERT_GT(inside, 1000);
  EXPECT_GT(painted_pixels, 0.99 * inside);
}

TEST(PaintCarrierTest, TheFitShowsThePaint) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  const PosedCamera painted = CameraAt(0.0);
  const Vector3f red(0.8f, 0.2f, 0.2f);
  const ColorEdit edit = EditOf({PaintOf(
      painted, [&](int x, int) { return x < kWidth / 2 ? red : Vector3f(0.5f, 0.5f, 0.5f); })});
  auto carrier =
      std::make_shared<PaintCarrier>(edit, std::vector<PosedCamera>{painted}, scene.model);
  std::vector<Mask> masks;
  std::vector<RefitTarget> targets;
  for (const double azimuth : {-0.4, 0.0, 0.4}) masks.push_back(InsideMask(CameraAt(azimuth)));
  for (size_t v = 0; v < masks.size(); ++v) {
    RefitTarget target{"view", CameraAt(0.4 * (double(v) - 1)), &masks[v]};
    target.edited = [carrier, camera = target.camera, mask = target.mask](Renderer& renderer,
                                                                          Mask* leaves) {
      return carrier->Target(renderer, camera, *mask, nullptr, leaves);
    };
    targets.push_back(target);
  }
  Monitor monitor;
  ShRefitter refitter(scene.renderer, scene.model, targets, edit, {}, RefitOptions(), monitor);
  refitter.Run(monitor);
  scene.renderer.SetSh(refitter.Sh());
  const Image after = scene.renderer.Render(CameraAt(0.3)).rgb;
  // Well inside each half; the tolerance is the sweeps' remaining error.
  EXPECT_NEAR(after(55, 60, 0), red[0], 0.05f);
  EXPECT_NEAR(after(55, 60, 1), red[1], 0.05f);
  EXPECT_NEAR(after(105, 60, 0), 0.5f, 0.05f);
}

// Root of the mean squared difference inside a mask.
double Apart(const Image& a, const Image& b, const Mask& mask) {
  double squares = 0;
  int count = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    if (mask.data[i / 3] == 0) continue;
    const double difference = double(a.data[i]) - double(b.data[i]);
    squares += difference * difference, ++count;
  }
  return std::sqrt(squares / count);
}

TEST(GaussianPaintTest, WhatShowsBeforeTheFitIsNearToIt) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  const PosedCamera painted = CameraAt(0.1), other = CameraAt(-0.2);
  const ColorEdit edit =
      EditOf({PaintOf(painted, [&](int x, int y) { return Stripes(painted, x, y); })});
  const GaussianPaint paint =
      FindGaussianPaint(scene.renderer, scene.model, edit.operations[0].picture, {painted});
  EXPECT_TRUE(paint.IsOf(*edit.operations[0].picture));
  auto carrier =
      std::make_shared<PaintCarrier>(edit, std::vector<PosedCamera>{painted}, scene.model);
  const std::vector<PosedCamera> cameras = {CameraAt(-0.4), CameraAt(0.0), CameraAt(0.4)};
  std::vector<Mask> masks;
  for (const PosedCamera& camera : cameras) masks.push_back(InsideMask(camera));
  std::vector<RefitTarget> targets;
  for (size_t v = 0; v < cameras.size(); ++v) {
    RefitTarget target{"view", cameras[v], &masks[v]};
    target.edited = [carrier, camera = target.camera, mask = target.mask](Renderer& renderer,
                                                                          Mask* leaves) {
      return carrier->Target(renderer, camera, *mask, nullptr, leaves);
    };
    targets.push_back(target);
  }
  Monitor monitor;
  const std::vector<float> shares = MaskShares(scene.renderer, targets, monitor);
  const RefitOptions options;
  FloatArray preview = scene.model.sh;
  const auto preview_of = [&](const ColorEdit& one, std::span<const int32_t> gaussians,
                              std::span<const float> sh, std::span<const float> of) {
    return PaintChange(sh, 4, of, one, &paint, options.active_threshold, gaussians);
  };
  preview_of(edit, {}, preview, shares).AddTo(preview);
  const auto shown = [&](std::span<const float> sh) {
    scene.renderer.SetSh(sh);
    return scene.renderer.Render(other).rgb;
  };
  const Image before = shown(scene.model.sh), now = shown(preview);
  ShRefitter refitter(scene.renderer, scene.model, targets, edit, shares, options, monitor, &paint);
  const Image start = shown(refitter.Sh());
  scene.renderer.SetSh(scene.model.sh);
  refitter.Run(monitor);
  const Image fitted = shown(refitter.Sh());
  // The stripes are 19 pixels wide. A Gaussian of 1.3 pixels takes the mean of its pixels in the
  // painted view. Where others hide one side of it, it shows up to a pixel and a half aside. At the
  // edges of the stripes, the preview is off by up to a third of the change.
  const Mask mask = InsideMask(other);
  EXPECT_GT(Apart(before, fitted, mask), 0.15);
  EXPECT_LT(Apart(now, fitted, mask), 0.5 * Apart(before, fitted, mask));
  // The fit starts there, but for the Gaussians at the border of the masks.
  EXPECT_LT(Apart(start, fitted, mask), 0.5 * Apart(before, fitted, mask));

  // A part of the scene changes as it does in the whole.
  std::vector<int32_t> some;
  std::vector<float> sh, some_shares;
  for (size_t g = 7; g < scene.model.NumGaussians(); g += 5) {
    some.push_back(int32_t(g));
    some_shares.push_back(shares[g]);
    sh.insert(sh.end(), &scene.model.sh[g * 12], &scene.model.sh[g * 12] + 12);
  }
  preview_of(edit, some, sh, some_shares).AddTo(sh);
  for (size_t i = 0; i < sh.size(); ++i) {
    EXPECT_EQ(sh[i], preview[size_t(some[i / 12]) * 12 + i % 12]) << i;
  }
  // Nothing of it is done at no strength, and nothing of other layers.
  ColorEdit none = edit.WithStrength(0);
  FloatArray same = scene.model.sh;
  preview_of(none, {}, same, shares).AddTo(same);
  EXPECT_EQ(same, scene.model.sh);
  const ColorEdit another = EditOf({PaintOf(painted, [&](int, int) { return kDark; })});
  preview_of(another, {}, same, shares).AddTo(same);
  EXPECT_EQ(same, scene.model.sh);
}

TEST(GaussianPaintTest, WhatThePaintedViewDoesNotSeeTakesNothing) {
  // A small square in front of the large one hides some of it.
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}, {0.2, -1.5, {0.3f, 0.3f, 0.3f}}});
  const PosedCamera painted = CameraAt(0.0);
  const Vector3f red(0.9f, 0.1f, 0.1f);
  const ColorEdit edit = EditOf({PaintOf(painted, [&](int, int) { return red; })});
  const GaussianPaint paint =
      FindGaussianPaint(scene.renderer, scene.model, edit.operations[0].picture, {painted});
  const auto nearest = [&](const Vector3d& point) {
    size_t best = 0;
    double least = 1e9;
    for (size_t g = 0; g < scene.model.NumGaussians(); ++g) {
      const double distance = (Vector3f(&scene.model.means[3 * g]).cast<double>() - point).norm();
      if (distance < least) least = distance, best = g;
    }
    return int32_t(best);
  };
  const auto find = [&](const Vector3d& point) -> const PaintedGaussian* {
    const int32_t index = nearest(point);
    for (const PaintedGaussian& one : paint.gaussians) {
      if (one.index == index) return &one;
    }
    return nullptr;
  };
  EXPECT_FALSE(find({0, 0, 0}));  // behind the small square
  for (const Vector3d& point : {Vector3d(0.7, 0.6, 0), Vector3d(0, 0, -1.5)}) {
    const PaintedGaussian* one = find(point);
    ASSERT_TRUE(one);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(one->color[c], red[c], 0.5 / 255 + 1e-4);
    EXPECT_NEAR(one->alpha, 1, 1e-4);  // far from the paint's border
    EXPECT_NEAR(one->seen.norm(), 1, 1e-5);
    EXPECT_GT(one->seen.z(), 0);  // the cameras look along z
  }
}

TEST(GaussianPaintTest, LightMovesWithTheViewer) {
  Scene scene({{1.0, 0, {0.5f, 0.5f, 0.5f}}});
  // Brighter from one side: the coefficients of x.
  for (size_t g = 0; g < scene.model.NumGaussians(); ++g) {
    for (size_t c = 0; c < 3; ++c) scene.model.sh[g * 12 + 9 + c] = 0.3f;
  }
  const PosedCamera painted = CameraAt(0.0);
  const Vector3f blue(0.1f, 0.2f, 0.5f);
  const ColorEdit edit = EditOf({PaintOf(painted, [&](int, int) { return blue; })});
  const GaussianPaint paint =
      FindGaussianPaint(scene.renderer, scene.model, edit.operations[0].picture, {painted});
  FloatArray sh = scene.model.sh;
  const std::vector<float> shares(scene.model.NumGaussians(), 1.0f);
  PaintChange(sh, 4, shares, edit, &paint, 0).AddTo(sh);
  const auto middle = [&](std::span<const float> of, const PosedCamera& view) {
    scene.renderer.SetSh(of);
    return LinearFromSrgb(scene.renderer.Render(view).rgb(kWidth / 2, kHeight / 2, 2));
  };
  for (const double azimuth : {-0.5, 0.5}) {
    const PosedCamera other = CameraAt(azimuth);
    const float before = middle(scene.model.sh, other) / middle(scene.model.sh, painted);
    const float now = middle(sh, other) / middle(sh, painted);
    ASSERT_GT(std::abs(before - 1), 0.1f);
    // Less than the whole ratio, since dark colors are trusted less; degree 1 bends it a little.
    EXPECT_GT((now - 1) / (before - 1), 0.5f);
    EXPECT_LT((now - 1) / (before - 1), 1.2f);
  }
  // As painted, from where it was painted; degree 1 has no more than a slope.
  EXPECT_NEAR(middle(sh, painted), LinearFromSrgb(blue[2]), 0.02f);
}

}  // namespace
}  // namespace retint
