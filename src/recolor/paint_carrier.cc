// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/paint_carrier.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/parallel.h"
#include "kernels/common/color_spaces.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

constexpr double kDepthTolerance = 0.02;  // relative
constexpr double kOwnPicture = 100;       // weight of a view's own picture beside others
constexpr double kLeastCosine = 0.1;      // at which a painted view sees a surface
constexpr double kSameSurface = 0.01;     // relative depth: surfaces that are farther apart are not
constexpr int kRim = 2;                   // pixels from a selection's end
// Of fitted planes: the smaller side over the distance between the 5 x 5 pixels of a fit, the
// weights of these by their squared distance, and the least number of them.
constexpr int kPixelsPerStep = 400;
constexpr double kNearWeights[9] = {1, 0.88, 0.78, 0, 0.61, 0.54, 0, 0, 0.37};  // exp(-d^2 / 8)
constexpr int kLeastPixels = 6;
constexpr double kSteady = 0.01;
constexpr int kMostSamples = 4;  // a side, of a pixel's footprint
// Light is compared over some pixels about each: the smaller side over their reach, which is at
// least 3.
constexpr int kPixelsPerLightReach = 130;

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
      : view_(view),
        depth_(depth),
        center_(view.Center()),
        step_(std::max(1, std::min(depth.width, depth.height) / kPixelsPerStep)) {}

  // The depth of single Gaussians is too rough for a normal, and would move the look-up.
  std::optional<Surface> At(int x, int y) const {
    const double z = double(depth_(x, y));
    if (!(z > 0)) return std::nullopt;
    const auto plane = Plane(x, y, step_, [&](int, int, double other) {
      return std::abs(other - z) <= kDepthTolerance * z;
    });
    if (!plane) {
      const Eigen::Vector3d point = Point(x, y, z);
      return Surface{point, (center_ - point).normalized()};
    }
    Surface surface = SurfaceOf(*plane, x, y);
    if (std::abs(1 / (*plane)[0] - z) > kSameSurface * z) surface.point = Point(x, y, z);
    return surface;
  }

  // For a pixel near the end of a selection, whose depth may be that of another surface: the place
  // where it meets the plane through the nearby pixels of `within`. None if the pixel's depth is
  // that of the plane, or too few such pixels are near.
  std::optional<Surface> Continued(int x, int y, const Mask& within) const {
    const auto plane =
        Plane(x, y, 2 * step_, [&](int px, int py, double) { return within(px, py) > 0; });
    if (!plane) return std::nullopt;
    const double z = 1 / (*plane)[0];
    if (std::abs(double(depth_(x, y)) - z) <= kSameSurface * z) return std::nullopt;
    return SurfaceOf(*plane, x, y);
  }

  // The point at which the ray through a pixel position meets the surface's plane.
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

  // 1 / z of a plane is linear in the pixel's position. Returns its value and its changes to the
  // right and down at this pixel, for the plane through nearby pixels, `step` apart, with
  // `belongs(x, y, z)`. None if there are too few.
  template <typename Belongs>
  std::optional<Eigen::Vector3d> Plane(int x, int y, int step, const Belongs& belongs) const {
    double one = 0, x1 = 0, y1 = 0, xx = 0, xy = 0, yy = 0;  // sums of weights times these
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    int count = 0;
    for (int i = 0; i < 25; ++i) {
      const int dx = i % 5 - 2, dy = i / 5 - 2, px = x + step * dx, py = y + step * dy;
      if (!depth_.Contains(px, py)) continue;
      const double z = double(depth_(px, py));
      if (!(z > 0) || !belongs(px, py, z)) continue;
      const double weight = kNearWeights[dx * dx + dy * dy];
      one += weight, x1 += weight * dx, y1 += weight * dy;
      xx += weight * (dx * dx), xy += weight * (dx * dy), yy += weight * (dy * dy);
      right += weight / z * Eigen::Vector3d(1, dx, dy);
      ++count;
    }
    if (count < kLeastPixels) return std::nullopt;
    xx += kSteady * one, yy += kSteady * one;  // for pixels in one row
    Eigen::Matrix3d matrix;
    matrix << one, x1, y1, x1, xx, xy, y1, xy, yy;
    Eigen::Vector3d plane = matrix.inverse() * right;
    plane.tail<2>() /= step;
    if (!(plane[0] > 0)) return std::nullopt;
    return plane;
  }

  // A pixel of a plane as Plane() has it.
  Surface SurfaceOf(const Eigen::Vector3d& plane, int x, int y) const {
    const double z = 1 / plane[0];
    const Eigen::Vector3d point = Point(x, y, z);
    // d z = -z^2 d (1 / z).
    const Eigen::Vector3d ray = (point - center_) / z;
    const Eigen::Vector3d right = view_.Unproject({x + 1.5, y + 0.5}, 1) - center_ - ray;
    const Eigen::Vector3d down = view_.Unproject({x + 0.5, y + 1.5}, 1) - center_ - ray;
    Surface surface{point, (right - z * plane[1] * ray).cross(down - z * plane[2] * ray)};
    if (surface.normal.dot(center_ - point) < 0) surface.normal = -surface.normal;
    surface.normal.normalize();
    return surface;
  }

  const PosedCamera& view_;
  const DepthMap& depth_;
  Eigen::Vector3d center_;
  int step_;  // pixels
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

// 255 at the pixels of a mask that have none of another kind within `reach` pixels along rows and
// columns.
Mask Within(const Mask& mask, int reach) {
  Mask within(mask.width, mask.height), across = within;
  const auto holds = [](const Mask& in, int x, int y, int dx, int dy) {
    return !in.Contains(x + dx, y + dy) || IsInside(in(x + dx, y + dy));
  };
  for (const bool down : {false, true}) {
    const Mask& from = down ? across : mask;
    Mask& to = down ? within : across;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        bool all = true;
        for (int i = -reach; i <= reach && all; ++i) {
          all = holds(from, x, y, down ? 0 : i, down ? i : 0);
        }
        to(x, y) = all ? 255 : 0;
      }
    }
  }
  return within;
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
  std::vector<float> weight;  // how squarely the painted view sees the surface; 0: not at all
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

// A view that will be painted, and the surfaces of its masked pixels: found once for all layers, in
// the order of the pixels of each row.
struct PaintCarrier::Shown {
  const PosedCamera& view;
  const Image& render;
  const Mask& mask;
  ViewSurfaces surfaces;
  std::vector<std::vector<std::optional<Surface>>> rows;

  Shown(const PosedCamera& camera, const RenderOutput& own, const Mask& inside)
      : view(camera),
        render(own.rgb),
        mask(inside),
        // The median: if a surface lets one percent through, a wall a meter behind it would move
        // the blended mean by a centimeter.
        surfaces(camera, own.depth_median) {}

  void FindSurfaces() {
    rows.resize(size_t(mask.height));
    const Mask within = Within(mask, kRim);
    ParallelTasks(mask.height, [&](int64_t row) {
      const int y = int(row);
      for (int x = 0; x < mask.width; ++x) {
        if (mask(x, y) == 0) continue;
        const bool rim = IsInside(mask(x, y)) && !within(x, y);
        const auto continued = rim ? surfaces.Continued(x, y, within) : std::nullopt;
        rows[size_t(row)].push_back(continued ? continued : surfaces.At(x, y));
      }
    });
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

// The paint on the Gaussians that a view shows, by their weights.
struct PaintCarrier::Blended {
  std::vector<float> pixels;  // [H, W, 4] color times cover, and cover

  // Nothing where less than half of the pixel is painted.
  Paint At(size_t p) const {
    Paint paint;
    const float* pixel = &pixels[4 * p];
    if (pixel[3] < 0.5f) return paint;
    for (int c = 0; c < 3; ++c) paint.color[c] = pixel[c] / pixel[3];
    paint.alpha = 1;
    return paint;
  }
};

PaintCarrier::PaintCarrier(const ColorEdit& edit, std::vector<PosedCamera> cameras,
                           const GaussianModel& model, std::shared_ptr<const GaussianPaint> paint)
    : edit_(edit), unclipped_(edit, OutOfRange::kLeft), model_(model), paint_(std::move(paint)) {
  const size_t layers = edit_.picture() ? edit_.picture()->layers.size() : 0;
  CheckOption(cameras.size() == layers, "paint: one camera a layer is needed");
  for (PosedCamera& camera : cameras) sources_.push_back({std::move(camera), {}, {}});
  if (paint_ && !paint_->IsOf(*edit_.picture())) paint_ = nullptr;
}

PaintCarrier::~PaintCarrier() = default;

// The painted views, and their paint on the Gaussians.
void PaintCarrier::Prepare(Renderer& renderer) {
  if (prepared_) return;
  std::vector<PosedCamera> cameras;
  for (Source& source : sources_) {
    RenderRequest request;
    request.depth_median = request.along_rays = true;
    RenderOutput output = renderer.Render(source.camera, request);
    source.render = std::move(output.rgb);
    source.depth = std::move(output.depth_median);
    cameras.push_back(source.camera);
  }
  if (!paint_) {
    paint_ = std::make_shared<const GaussianPaint>(
        FindGaussianPaint(renderer, model_, edit_.picture(), cameras));
  }
  of_gaussians_.resize(4 * model_.NumGaussians());
  for (const PaintedGaussian& one : paint_->gaussians) {
    float* const to = &of_gaussians_[4 * size_t(one.index)];
    for (int c = 0; c < 3; ++c) to[c] = one.alpha * one.color[c];
    to[3] = one.alpha;
  }
  prepared_ = true;
}

PaintCarrier::Blended PaintCarrier::BlendPaint(Renderer& renderer, const PosedCamera& view) const {
  Backend& backend = renderer.backend();
  const auto geometry = renderer.Geometry(view);
  const size_t pixels = size_t(view.camera.width) * size_t(view.camera.height);
  const size_t rows = size_t(geometry->num_rows());
  if (rows == 0) return {std::vector<float>(4 * pixels, 0.0f)};
  const std::vector<int32_t> gaussians = backend.Download(geometry->rows(), rows);
  std::vector<float> features(4 * rows);
  ParallelRanges(int64_t(rows), 8192, [&](int64_t begin, int64_t end) {
    for (auto r = size_t(begin); r < size_t(end); ++r) {
      std::copy_n(&of_gaussians_[4 * size_t(gaussians[r])], 4, &features[4 * r]);
    }
  });
  const auto on_device = backend.Upload(std::span<const float>(features));
  const auto image = backend.Allocate<float>(4 * pixels);
  backend.blend().Blend(*geometry,
                        {.features = on_device.data(), .channels = 4, .image = image.data()});
  return {backend.Download(image.data(), 4 * pixels)};
}

// The paint of layer `k` paints on a view.
void PaintCarrier::Carry(size_t k, const Shown& shown, Carried& carried) const {
  const Source& source = sources_[k];
  const PaintLayer& layer = edit_.picture()->layers[k];
  const Eigen::Vector3d eye = source.camera.Center();
  const Mask& mask = shown.mask;
  const auto keep = [&](int x, int y, const Paint& paint, double weight, float there) {
    const size_t p = mask.Index(x, y);
    carried.paint[p] = paint;
    carried.weight[p] = float(weight);
    if (paint.alpha <= 0) return;
    carried.here.data[p] = LightOf(&shown.render.data[3 * p]);
    carried.there.data[p] = there;
  };
  // Takes the paint of the painted view on a surface that the pixel shows.
  const auto take = [&](int x, int y, const std::optional<Surface>& surface) {
    const auto at = surface ? source.camera.Project(surface->point) : std::nullopt;
    if (!at) return;
    const double cosine = surface->normal.dot((eye - surface->point).normalized());
    if (cosine < kLeastCosine || !source.Sees(*at)) return;
    const Paint paint = PaintOnPixel(layer, source.camera, shown.surfaces, *surface, x, y, *at);
    keep(x, y, paint, cosine * cosine, LuminanceAt(source.render, (*at)[0], (*at)[1]));
  };
  const bool is_painted_view = source.camera == shown.view;
  ParallelTasks(mask.height, [&](int64_t row) {
    const int y = int(row);
    size_t next = 0;
    for (int x = 0; x < mask.width; ++x) {
      if (mask(x, y) == 0) continue;
      if (is_painted_view) {
        const Paint paint = PaintAt(layer, x + 0.5, y + 0.5);
        keep(x, y, paint, kOwnPicture, LightOf(&shown.render.data[3 * mask.Index(x, y)]));
      } else {
        take(x, y, shown.rows[size_t(row)][next++]);
      }
    }
  });
  const int reach = std::max(3, std::min(mask.width, mask.height) / kPixelsPerLightReach);
  BoxSum(carried.here, reach);
  BoxSum(carried.there, reach);
}

Image PaintCarrier::Target(Renderer& renderer, const PosedCamera& view, const Mask& mask,
                           const Image* photo, Mask* leaves) {
  Prepare(renderer);
  if (leaves) *leaves = Mask(mask.width, mask.height);
  RenderRequest request;
  request.depth_median = request.along_rays = true;
  RenderOutput own = renderer.Render(view, request);
  std::vector<Paint> merged(mask.NumPixels());  // color times weight; alpha the largest
  std::vector<float> weights(mask.NumPixels(), 0.0f);
  Mask seen(mask.width, mask.height);  // by a painted view
  Shown shown(view, own, mask);
  const auto is_other = [&](const Source& source) { return source.camera != view; };
  if (std::ranges::any_of(sources_, is_other)) shown.FindSurfaces();
  for (size_t k = 0; k < sources_.size(); ++k) {
    Carried carried(mask.width, mask.height);
    Carry(k, shown, carried);
    for (size_t p = 0; p < merged.size(); ++p) {
      const Paint& paint = carried.paint[p];
      if (carried.weight[p] > 0) seen.data[p] = 255;
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

  std::optional<Blended> blended;
  Image target = photo ? *photo : std::move(own.rgb);
  for (size_t p = 0; p < mask.NumPixels(); ++p) {
    if (mask.data[p] == 0) continue;
    const Eigen::Vector3f color(&target.data[3 * p]);
    Paint paint;
    if (weights[p] > 0) {
      paint.alpha = std::min(merged[p].alpha, 1.0f);
      for (int c = 0; c < 3; ++c) paint.color[c] = merged[p].color[c] / weights[p];
    } else if (!seen.data[p]) {
      if (!blended) blended = BlendPaint(renderer, view);
      paint = blended->At(p);
    }
    const Eigen::Vector3f edited = edit_.Apply(color, Eigen::Vector3f(paint.color), paint.alpha);
    if (leaves) {
      const Eigen::Vector3f clipped = color.cwiseMax(0.0f).cwiseMin(1.0f);
      const Eigen::Vector3f left =
          unclipped_.Apply(clipped, Eigen::Vector3f(paint.color), paint.alpha);
      const Eigen::Vector3f mixed = clipped + unclipped_.strength() * (left - clipped);
      leaves->data[p] = LeavesGamut(mixed.data()) ? 255 : 0;
    }
    const float share = edit_.strength() * float(mask.data[p]) / 255;
    for (int c = 0; c < 3; ++c) target.data[3 * p + size_t(c)] += share * (edited[c] - color[c]);
  }
  return target;
}

}  // namespace retint
