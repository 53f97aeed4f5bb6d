// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/paint_carrier.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/parallel.h"
#include "kernels/common/color_spaces.h"

namespace retint {
namespace {

constexpr double kDepthTolerance = 0.02;  // relative
constexpr double kLeastCosine = 0.1;      // at which a painted view sees a surface
constexpr int kNormalReach = 2;           // pixels to the neighbors that a normal is taken from
constexpr int kMostSamples = 4;           // a side, of a pixel's footprint
constexpr int kLightReach = 3;            // pixels: light is compared over 7 x 7 of them

struct Paint {
  float color[3] = {0, 0, 0};  // times alpha
  float alpha = 0;
};

// Weights of the four pixels about a position between the middle two, at `t` from the first of
// these: Catmull-Rom's cubic, which keeps edges sharper than a straight line.
std::array<float, 4> CubicWeights(float t) {
  return {0.5f * t * (t * (2 - t) - 1), 0.5f * (t * t * (3 * t - 5) + 2),
          0.5f * t * (t * (4 - 3 * t) + 1), 0.5f * t * t * (t - 1)};
}

// The layer at a position of its view; nothing outside.
Paint PaintAt(const PaintLayer& layer, double x, double y) {
  Paint paint;
  const double u = x - layer.x - 0.5, v = y - layer.y - 0.5;
  const double left = std::floor(u), top = std::floor(v);
  if (!(left >= -1 && top >= -1 && left < layer.alpha.width && top < layer.alpha.height)) {
    return paint;
  }
  const auto across = CubicWeights(float(u - left)), down = CubicWeights(float(v - top));
  for (size_t i = 0; i < 16; ++i) {
    const int px = int(left) + int(i % 4) - 1, py = int(top) + int(i / 4) - 1;
    if (!layer.alpha.Contains(px, py)) continue;
    const float alpha = across[i % 4] * down[i / 4] * float(layer.alpha(px, py)) / 255;
    for (int c = 0; c < 3; ++c) paint.color[c] += alpha * float(layer.color(px, py, c)) / 255;
    paint.alpha += alpha;
  }
  // A cubic overshoots beside edges.
  paint.alpha = std::clamp(paint.alpha, 0.0f, 1.0f);
  for (float& value : paint.color) value = std::clamp(value, 0.0f, paint.alpha);
  return paint;
}

// Nearest pixel's value; 0 outside.
float ValueAt(const DepthMap& map, double x, double y) {
  const double px = std::floor(x), py = std::floor(y);
  if (!(px >= 0 && py >= 0 && px < map.width && py < map.height)) return 0;
  return map(int(px), int(py));
}

float LuminanceAt(const Image& image, double x, double y) {
  const double u = std::clamp(x - 0.5, 0.0, double(image.width - 1));
  const double v = std::clamp(y - 0.5, 0.0, double(image.height - 1));
  const int left = std::min(int(u), std::max(image.width - 2, 0));
  const int top = std::min(int(v), std::max(image.height - 2, 0));
  const float fu = float(u - left), fv = float(v - top);
  float sum = 0;
  for (int i = 0; i < 4; ++i) {
    const int px = std::min(left + i % 2, image.width - 1);
    const int py = std::min(top + i / 2, image.height - 1);
    const float weight = (i % 2 ? fu : 1 - fu) * (i / 2 ? fv : 1 - fv);
    sum += weight * LightOf(&image.data[image.Index(px, py)]);
  }
  return sum;
}

// A surface point of the view that is to be painted.
struct Surface {
  Eigen::Vector3d point, normal;  // the normal faces the view; of unit length
};

class ViewSurfaces {
 public:
  ViewSurfaces(const PosedCamera& view, const DepthMap& depth)
      : view_(view), depth_(depth), center_(view.Center()) {}

  std::optional<Surface> At(int x, int y) const {
    const float z = depth_(x, y);
    if (!(z > 0)) return std::nullopt;
    Surface surface;
    surface.point = Point(x, y, double(z));
    const auto across = Difference(x, y, kNormalReach, 0, double(z));
    const auto down = Difference(x, y, 0, kNormalReach, double(z));
    const Eigen::Vector3d sight = center_ - surface.point;
    surface.normal = across && down ? across->cross(*down) : sight;
    if (!(surface.normal.norm() > 0)) surface.normal = sight;
    if (surface.normal.dot(sight) < 0) surface.normal = -surface.normal;
    surface.normal.normalize();
    return surface;
  }

  // Where the ray through a pixel position meets the surface's plane.
  std::optional<Eigen::Vector3d> OnPlane(const Surface& surface, double x, double y) const {
    const Eigen::Vector3d ray = view_.Unproject({x, y}, 1) - center_;
    const double along = surface.normal.dot(ray);
    if (std::abs(along) < 0.02 * ray.norm()) return std::nullopt;
    return center_ + ray * (surface.normal.dot(surface.point - center_) / along);
  }

 private:
  Eigen::Vector3d Point(int x, int y, double z) const {
    return view_.Unproject({x + 0.5, y + 0.5}, z);
  }

  // Between the neighbors on both sides, or one and the pixel itself where the other lies on
  // another surface.
  std::optional<Eigen::Vector3d> Difference(int x, int y, int dx, int dy, double z) const {
    Eigen::Vector3d ends[2] = {Point(x, y, z), Point(x, y, z)};
    bool any = false;
    for (const int side : {0, 1}) {
      const int px = side ? x + dx : x - dx, py = side ? y + dy : y - dy;
      if (!depth_.Contains(px, py)) continue;
      const double other = double(depth_(px, py));
      if (!(std::abs(other - z) <= 2 * kDepthTolerance * z)) continue;
      ends[side] = Point(px, py, other);
      any = true;
    }
    if (!any) return std::nullopt;
    return ends[1] - ends[0];
  }

  const PosedCamera& view_;
  const DepthMap& depth_;
  Eigen::Vector3d center_;
};

// Sums over the (2 reach + 1)^2 pixels about each.
void BoxSum(ScalarImage& image, int reach) {
  for (const bool down : {false, true}) {
    const int lines = down ? image.width : image.height, length = down ? image.height : image.width;
    ParallelTasks(int64_t(lines), [&](size_t line) {
      std::vector<double> sums(size_t(length) + 1, 0.0);
      const auto at = [&](int i) -> float& {
        return down ? image(int(line), i) : image(i, int(line));
      };
      for (int i = 0; i < length; ++i) sums[size_t(i) + 1] = sums[size_t(i)] + double(at(i));
      for (int i = 0; i < length; ++i) {
        const int low = std::max(i - reach, 0), high = std::min(i + reach + 1, length);
        at(i) = float(sums[size_t(high)] - sums[size_t(low)]);
      }
    });
  }
}

// The mean over the pixel's footprint.
Paint PaintOnPixel(const PaintLayer& layer, const PosedCamera& camera, const ViewSurfaces& surfaces,
                   const Surface& surface, int x, int y, const Eigen::Vector3d& at) {
  Eigen::Vector2d steps[2];
  double size = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const auto beside = surfaces.OnPlane(surface, x + (axis ? 0.5 : 1.5), y + (axis ? 1.5 : 0.5));
    const auto there = beside ? camera.Project(*beside) : std::nullopt;
    if (!there) return PaintAt(layer, at[0], at[1]);
    steps[axis] = there->head<2>() - at.head<2>();
    size = std::max(size, steps[axis].norm());
  }
  // A footprint hardly larger than a pixel needs no more than the layer's own filter.
  const int samples = std::clamp(int(std::ceil(size - 0.1)), 1, kMostSamples);
  Paint mean;
  for (int i = 0; i < samples * samples; ++i) {
    const double u = (i % samples + 0.5) / samples - 0.5, v = (i / samples + 0.5) / samples - 0.5;
    const Eigen::Vector2d place = at.head<2>() + u * steps[0] + v * steps[1];
    const Paint one = PaintAt(layer, place[0], place[1]);
    for (int c = 0; c < 3; ++c) mean.color[c] += one.color[c] / float(samples * samples);
    mean.alpha += one.alpha / float(samples * samples);
  }
  return mean;
}

}  // namespace

// One layer's paint on a view's pixels, and the light on the surface in both views.
struct PaintCarrier::Carried {
  std::vector<Paint> paint;   // [H, W]
  std::vector<float> weight;  // how squarely the painted view sees the surface
  ScalarImage here, there;    // luminance, 0 where there is no paint; then its sums

  Carried(int width, int height)
      : paint(size_t(width) * size_t(height)),
        weight(paint.size(), 0.0f),
        here(width, height),
        there(width, height) {}

  // How much brighter the surface is in this view.
  float Light(size_t p) const {
    constexpr float kLeast = 1e-3f;
    return std::clamp((here.data[p] + kLeast) / (there.data[p] + kLeast), 1 / kMostPaintLight,
                      kMostPaintLight);
  }
};

// A painted view as it is without the paint.
struct PaintCarrier::Source {
  PosedCamera camera;
  Image render;
  DepthMap depth;

  bool Sees(const Eigen::Vector3d& at) const {
    // A pixel's depth is that of its middle: on a slope a neighbor's may be nearer to it.
    for (const auto& [dx, dy] :
         {std::array{0.0, 0.0}, {-1.0, 0.0}, {1.0, 0.0}, {0.0, -1.0}, {0.0, 1.0}}) {
      const double seen = double(ValueAt(depth, at[0] + dx, at[1] + dy));
      if (seen > 0 && std::abs(seen - at[2]) <= kDepthTolerance * at[2]) return true;
    }
    return false;
  }
};

PaintCarrier::PaintCarrier(const ColorEdit& edit, std::vector<PosedCamera> cameras) : edit_(edit) {
  for (PosedCamera& camera : cameras) sources_.push_back({std::move(camera), {}, {}});
}

PaintCarrier::~PaintCarrier() = default;

void PaintCarrier::RenderSources(Renderer& renderer) {
  for (Source& source : sources_) {
    if (!source.render.Empty()) continue;
    RenderRequest request;
    request.depth_median = true;
    RenderOutput output = renderer.Render(source.camera, request);
    source.render = std::move(output.rgb);
    source.depth = std::move(output.depth_median);
  }
}

// What layer `k` paints on a view whose depth is `depth`.
void PaintCarrier::Carry(size_t k, const PosedCamera& view, const RenderOutput& own,
                         const Mask& mask, Carried& carried) const {
  const Source& source = sources_[k];
  const Eigen::Vector3d eye = source.camera.Center();
  // The median: where a surface lets one percent through, what lies a meter behind it would move
  // the blended mean by a centimeter.
  const DepthMap& depth = own.depth_median;
  const ViewSurfaces surfaces(view, depth);
  ParallelTasks(mask.height, [&](int64_t row) {
    const int y = int(row);
    for (int x = 0; x < mask.width; ++x) {
      if (mask(x, y) == 0) continue;
      const auto surface = surfaces.At(x, y);
      if (!surface) continue;
      const auto at = source.camera.Project(surface->point);
      if (!at) continue;
      const double cosine = surface->normal.dot((eye - surface->point).normalized());
      if (cosine < kLeastCosine || !source.Sees(*at)) continue;
      const Paint paint =
          PaintOnPixel(edit_.picture()->layers[k], source.camera, surfaces, *surface, x, y, *at);
      if (paint.alpha <= 0) continue;
      const size_t p = mask.Index(x, y);
      carried.paint[p] = paint;
      carried.weight[p] = float(cosine * cosine);
      carried.here.data[p] = LightOf(&own.rgb.data[3 * p]);
      carried.there.data[p] = LuminanceAt(source.render, (*at)[0], (*at)[1]);
    }
  });
  BoxSum(carried.here, kLightReach);
  BoxSum(carried.there, kLightReach);
}

Image PaintCarrier::Target(Renderer& renderer, const PosedCamera& view, const Mask& mask,
                           const Image* photo) {
  RenderSources(renderer);
  RenderRequest request;
  request.depth_median = true;
  RenderOutput own = renderer.Render(view, request);
  std::vector<Paint> merged(mask.NumPixels());  // color times weight; alpha the largest
  std::vector<float> weights(mask.NumPixels(), 0.0f);
  for (size_t k = 0; k < sources_.size(); ++k) {
    Carried carried(mask.width, mask.height);
    Carry(k, view, own, mask, carried);
    for (size_t p = 0; p < merged.size(); ++p) {
      const Paint& paint = carried.paint[p];
      if (paint.alpha <= 0) continue;
      const float weight = carried.weight[p] * paint.alpha, light = carried.Light(p);
      for (int c = 0; c < 3; ++c) {
        merged[p].color[c] +=
            weight * SrgbFromLinear(light * LinearFromSrgb(paint.color[c] / paint.alpha));
      }
      weights[p] += weight;
      merged[p].alpha = std::max(merged[p].alpha, paint.alpha);
    }
  }

  Image target = photo ? *photo : std::move(own.rgb);
  for (size_t p = 0; p < mask.NumPixels(); ++p) {
    if (mask.data[p] == 0) continue;
    const Eigen::Vector3f color(&target.data[3 * p]);
    Eigen::Vector3f painted = Eigen::Vector3f::Zero();
    if (weights[p] > 0) painted = Eigen::Vector3f(merged[p].color) / weights[p];
    const Eigen::Vector3f edited =
        edit_.Apply(color, painted, weights[p] > 0 ? std::min(merged[p].alpha, 1.0f) : 0.0f);
    const float share = edit_.strength() * float(mask.data[p]) / 255;
    for (int c = 0; c < 3; ++c) target.data[3 * p + size_t(c)] += share * (edited[c] - color[c]);
  }
  return target;
}

}  // namespace retint
