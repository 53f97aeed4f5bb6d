// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/network_mask.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/error.h"
#include "kernels/common/quantize.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"
#include "selection/mask_tools/scribbles.h"

namespace retint {
namespace {

constexpr double kDoubt = 0.01;  // of the longer side

// Green inside, red outside, and a rectangle's border in blue; empty without any.
Image8 Picture(const Strokes& drawn, const ObjectPrompt& prompt, int width, int height) {
  if (drawn.inside.Empty() && drawn.outside.Empty() && !prompt.rectangle) return {};
  Image8 picture(width, height);
  Mask rectangle(width, height);
  if (prompt.rectangle) {
    const Eigen::Vector2d a = prompt.rectangle->front(), b = prompt.rectangle->back();
    DrawStroke({a, {b.x(), a.y()}, b, {a.x(), b.y()}, a}, 1, &rectangle);
  }
  for (size_t p = 0; p < rectangle.data.size(); ++p) {
    if (!drawn.outside.Empty() && IsInside(drawn.outside.data[p])) picture.data[3 * p] = 255;
    if (!drawn.inside.Empty() && IsInside(drawn.inside.data[p])) picture.data[3 * p + 1] = 255;
    if (IsInside(rectangle.data[p])) picture.data[3 * p + 2] = 255;
  }
  return picture;
}

// Pixels of strokes as points for the network: a few, spread over all.
std::vector<Eigen::Vector2d> PointsIn(const Mask& drawn) {
  std::vector<Eigen::Vector2d> all, some;
  for (int y = 0; y < drawn.height; ++y) {
    for (int x = 0; x < drawn.width; ++x) {
      if (IsInside(drawn(x, y))) all.emplace_back(x + 0.5, y + 0.5);
    }
  }
  constexpr size_t kMost = 8;
  const size_t count = std::min(kMost, all.size());
  for (size_t i = 0; i < count; ++i) some.push_back(all[(2 * i + 1) * all.size() / (2 * count)]);
  return some;
}

// A small disc at each point, which the refinement takes as proof.
void DrawPoints(const std::vector<Eigen::Vector2d>& points, int width, int height, Mask* drawn) {
  if (points.empty()) return;
  if (drawn->Empty()) *drawn = Mask(width, height);
  constexpr double kDisc = 3;  // pixels
  for (const Eigen::Vector2d& point : points) DrawStroke({point}, kDisc, drawn);
}

// A row or column of `count` pixels, `step` apart: 0 also within `radius` of a 0. Beyond the ends
// it goes on as it is.
void ShrinkLine(uint8_t* line, int count, size_t step, int radius) {
  int last = -radius - 1;  // the last 0
  std::vector<uint8_t> out(static_cast<size_t>(count), 255);
  for (const bool back : {false, true}) {
    last = -radius - 1;
    for (int i = 0; i < count; ++i) {
      const int at = back ? count - 1 - i : i;
      if (line[size_t(at) * step] == 0) last = i;
      if (i - last <= radius) out[size_t(at)] = 0;
    }
  }
  for (int i = 0; i < count; ++i) line[size_t(i) * step] = out[size_t(i)];
}

// By a square of 2 * radius + 1 pixels.
Mask Shrunk(Mask mask, int radius) {
  for (int y = 0; y < mask.height; ++y) ShrinkLine(&mask(0, y), mask.width, 1, radius);
  for (int x = 0; x < mask.width; ++x) {
    ShrinkLine(&mask(x, 0), mask.height, size_t(mask.width), radius);
  }
  return mask;
}

// Adds `drawn` to `mask`, and removes `other` from it.
void Draw(const Mask& drawn, const Mask& other, Mask* mask) {
  for (size_t p = 0; p < mask->data.size(); ++p) {
    if (!drawn.Empty() && IsInside(drawn.data[p])) mask->data[p] = 255;
    if (!other.Empty() && IsInside(other.data[p])) mask->data[p] = 0;
  }
}

}  // namespace

Strokes StrokesOf(const MaskNetwork& network, const Image& color, Strokes drawn,
                  ObjectPrompt prompt, Monitor& monitor) {
  const std::vector<Eigen::Vector2d> inside = PointsIn(drawn.inside);
  const std::vector<Eigen::Vector2d> outside = PointsIn(drawn.outside);
  DrawPoints(prompt.inside, color.width, color.height, &drawn.inside);
  DrawPoints(prompt.outside, color.width, color.height, &drawn.outside);
  prompt.inside.insert(prompt.inside.end(), inside.begin(), inside.end());
  prompt.outside.insert(prompt.outside.end(), outside.begin(), outside.end());
  Image8 bytes(color.width, color.height);
  std::transform(color.data.begin(), color.data.end(), bytes.data.begin(), ColorToByte);
  const ScalarImage sure =
      network.Outline(bytes, prompt, Picture(drawn, prompt, color.width, color.height), monitor);
  Strokes strokes{Mask(color.width, color.height), Mask(color.width, color.height)};
  for (size_t p = 0; p < sure.data.size(); ++p) {
    (sure.data[p] >= 0.5f ? strokes.inside : strokes.outside).data[p] = 255;
  }
  Draw(drawn.inside, drawn.outside, &strokes.inside);
  Draw(drawn.outside, drawn.inside, &strokes.outside);
  for (const Mask* part : {&strokes.inside, &strokes.outside}) {
    if (AnySet(*part)) continue;
    throw InputError(network.Identity() + ": finds no object in the picture" +
                     (part == &strokes.inside ? "" : ", for all of it is inside"));
  }
  const int radius = std::max(2, int(kDoubt * std::max(color.width, color.height)));
  for (Mask* part : {&strokes.inside, &strokes.outside}) {
    Mask core = Shrunk(*part, radius);
    if (AnySet(core)) *part = std::move(core);  // thin parts stay whole
  }
  Draw(drawn.inside, drawn.outside, &strokes.inside);
  Draw(drawn.outside, drawn.inside, &strokes.outside);
  return strokes;
}

}  // namespace retint
