// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include <Eigen/Cholesky>

#include "base/parallel.h"
#include "kernels/common/sh.h"
#include "kernels/common/types.h"
#include "synthetic/discs.h"
#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr int kMaxRing = 18;             // pixels
constexpr double kRadiusPerRing = 0.42;  // a disc's radius per distance to the nearest change
constexpr double kMinRadius = 1.6;       // pixels between neighbors where texture is finest
constexpr double kFineRadius = 1.25;     // the same on objects that are meant to be selected
constexpr float kFlatColor = 0.055f;     // largest change of color that one disc may cover
constexpr float kFlatNormal = 0.985f;    // cosine of the largest change of normal
constexpr double kOpacity = 0.96;
constexpr double kShingle = 1.0;      // offset of a disc's visible part, in its standard deviations
constexpr double kRidge = 0.02;       // per view, on the higher SH degrees of matt surfaces
constexpr double kLevelRatio = 1.25;  // between levels of world radius

// How large a disc a pixel allows: by the distance to where its part's color or normal changes or
// its surface ends.
class RadiusFinder {
 public:
  RadiusFinder(const World& world, const TracedView& view)
      : world_(world), view_(view), mixed_(view.parts.width, view.parts.height) {
    const auto& depth = view.truth.depth;
    for (int y = 0; y < mixed_.height; ++y) {
      for (int x = 0; x < mixed_.width; ++x) {
        for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
          if (!view.parts.Contains(x + dx, y + dy)) continue;
          if (view.parts(x + dx, y + dy) == view.parts(x, y)) continue;
          const bool nearer = depth(x + dx, y + dy) < 0.97f * depth(x, y);
          mixed_(x, y) = std::max<uint8_t>(mixed_(x, y), nearer ? 2 : 1);
        }
      }
    }
  }

  // Pixels; 0 where a nearer object's edge spoils the pixel.
  double At(int x, int y) const {
    if (mixed_(x, y) == 2) return 0;
    int clear = mixed_(x, y) ? -1 : 0;  // rings without a change
    for (int ring = 1; ring == clear + 1 && ring <= kMaxRing; ++ring) {
      const int step = 1 + ring / 5;
      bool stopped = false;
      for (int k = -ring; k <= ring && !stopped; k += step) {
        stopped = Stops(x, y, x + k, y - ring) || Stops(x, y, x + k, y + ring) ||
                  Stops(x, y, x - ring, y + k) || Stops(x, y, x + ring, y + k);
      }
      clear += !stopped;
    }
    const double least = world_.ObjectOf(view_.parts(x, y)).furniture ? kMinRadius : kFineRadius;
    return std::max(least, kRadiusPerRing * clear + 0.4);
  }

 private:
  bool Stops(int x, int y, int nx, int ny) const {
    if (!view_.parts.Contains(nx, ny) || view_.parts(nx, ny) != view_.parts(x, y)) return false;
    if (mixed_(nx, ny)) return mixed_(nx, ny) == 1;
    const float* a = &view_.truth.photo.data[view_.truth.photo.Index(x, y)];
    const float* b = &view_.truth.photo.data[view_.truth.photo.Index(nx, ny)];
    const float* m = &view_.truth.normals.data[view_.truth.normals.Index(x, y)];
    const float* n = &view_.truth.normals.data[view_.truth.normals.Index(nx, ny)];
    return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])}) >
               kFlatColor ||
           m[0] * n[0] + m[1] * n[1] + m[2] * n[2] < kFlatNormal;
  }

  const World& world_;
  const TracedView& view_;
  // 1: beside another part, so the color is mixed; 2: and that part is nearer.
  PixelArray<uint8_t, 1> mixed_;
};

// Candidates of all views, by part.
std::vector<std::vector<Seed>> CollectSeeds(const World& world,
                                            const std::vector<TracedView>& views, uint64_t seed) {
  std::vector<std::vector<std::vector<Seed>>> of_view(views.size());
  ParallelTasks(int64_t(views.size()), [&](size_t v) {
    const TracedView& view = views[v];
    const RadiusFinder finder(world, view);
    // For large discs few candidates will do; most views only fill gaps of others.
    const double density = view.padding > 0 ? 7 : 0.8;
    auto& out = of_view[v];
    out.resize(world.parts.size());
    const double focal = view.camera.camera.fx();
    for (int y = 0; y < view.parts.height; ++y) {
      for (int x = 0; x < view.parts.width; ++x) {
        const int part = view.parts(x, y);
        if (part < 0) continue;
        const uint64_t order = HashOf(seed, v, uint64_t(y) << 32 | uint64_t(x));
        const double lot = Unit(Mix(order));
        if (lot * kFineRadius * kFineRadius > density) continue;
        const double pixels = finder.At(x, y);
        if (pixels == 0 || lot * pixels * pixels > density) continue;
        const double z = view.truth.depth(x, y);
        const Ray ray = PixelRay(view.camera, x + 0.5, y + 0.5);
        const double slant = std::clamp(
            std::abs(view.NormalAt(x, y).dot(ray.direction)) / ray.direction.norm(), 0.25, 1.0);
        const double wanted = pixels * z / focal / std::sqrt(slant);
        const int level = int(std::floor(std::log(wanted) / std::log(kLevelRatio)));
        Vec3 point = ray.origin + z * ray.direction;
        const auto strand = world.parts[size_t(part)].shape->StrandAt(point);
        if (strand) point = strand->point;
        out[size_t(part)].push_back({point, std::pow(kLevelRatio, level), pixels,
                                     uint32_t(y) * uint32_t(view.parts.width) + uint32_t(x),
                                     uint16_t(v), int16_t(level), order});
      }
    }
  });
  std::vector<std::vector<Seed>> seeds(world.parts.size());
  for (auto& parts : of_view) {
    for (size_t p = 0; p < parts.size(); ++p) {
      seeds[p].insert(seeds[p].end(), parts[p].begin(), parts[p].end());
    }
    parts = {};
  }
  return seeds;
}

// Poisson-disc selection, finest level first: a candidate stays unless a kept one is nearer than
// the mean of their radii.
std::vector<Seed> Thin(std::vector<Seed> seeds) {
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
    return a.level != b.level ? a.level < b.level : a.order < b.order;
  });
  std::vector<Seed> kept;
  std::vector<int> next;                    // of the kept ones in the same cell, -1 the last
  std::unordered_map<uint64_t, int> heads;  // the first one in each cell
  double cell = 0;                          // its size, the radius of the level
  const auto cell_of = [&](const Vec3& p) {
    return Eigen::Array3i((p.array() / cell).floor().cast<int>());
  };
  const auto key = [](const Eigen::Array3i& c) {
    return HashOf(uint64_t(uint32_t(c.x())) << 32 | uint32_t(c.y()), uint64_t(uint32_t(c.z())));
  };
  const auto insert = [&](size_t i) {
    int& head = heads.try_emplace(key(cell_of(kept[i].point)), -1).first->second;
    next.push_back(head);
    head = int(i);
  };
  for (size_t s = 0; s < seeds.size(); ++s) {
    if (s == 0 || seeds[s].level != seeds[s - 1].level) {
      cell = seeds[s].radius;
      heads.clear();
      next.clear();
      for (size_t i = 0; i < kept.size(); ++i) insert(i);
    }
    const Eigen::Array3i home = cell_of(seeds[s].point);
    bool covered = false;
    for (int k = 0; k < 27 && !covered; ++k) {
      const int c = (k + 13) % 27;  // the seed's own cell first: there most of them end
      const auto head = heads.find(key(home + Eigen::Array3i(c % 3 - 1, c / 3 % 3 - 1, c / 9 - 1)));
      for (int i = head == heads.end() ? -1 : head->second; i >= 0 && !covered;
           i = next[size_t(i)]) {
        const double apart = 0.5 * (kept[size_t(i)].radius + cell);
        covered = (kept[size_t(i)].point - seeds[s].point).squaredNorm() < apart * apart;
      }
    }
    if (covered) continue;
    kept.push_back(seeds[s]);
    insert(kept.size() - 1);
  }
  return kept;
}

// The place of a disc in a view. Neighbors on its near side cover it, it covers those on its far
// side: its visible part lies off its center, towards larger depth.
std::optional<Vec2> VisibleSpot(const TracedView& view, const Disc& disc) {
  auto spot = Sees(view, disc.part, disc.surface);
  if (!spot) return spot;
  const Vec3 in_camera = view.camera.cam_from_world * disc.surface;
  const Vec3 normal = view.camera.cam_from_world.rotation * disc.normal;
  const Vec2 downhill = normal.head<2>();
  if (downhill.norm() < 1e-6) return spot;
  const double slant = std::abs(normal.dot(in_camera)) / in_camera.norm();
  const double sigma =
      std::sqrt(disc.sigma[0] * disc.sigma[1]) * view.camera.camera.fx() / in_camera.z() * slant;
  *spot += kShingle * std::sqrt(sigma * sigma + kCovarianceDilation) * downhill.normalized();
  return spot;
}

// Bilinear photo, pixel centers at 0.5; none where another part mixes in.
std::optional<Vec3> LookUp(const TracedView& view, int part, const Vec2& xy) {
  const double fx = std::floor(xy.x() - 0.5), fy = std::floor(xy.y() - 0.5);
  const double u = xy.x() - 0.5 - fx, v = xy.y() - 0.5 - fy;
  Vec3 color = Vec3::Zero();
  for (int k = 0; k < 4; ++k) {
    const int x = int(fx) + k % 2, y = int(fy) + k / 2;
    if (!view.parts.Contains(x, y) || view.parts(x, y) != part) return std::nullopt;
    const double weight = (k % 2 ? u : 1 - u) * (k / 2 ? v : 1 - v);
    for (int c = 0; c < 3; ++c) color[c] += weight * view.truth.photo(x, y, c);
  }
  return color;
}

// The photo where it shows the rod that the bead is on.
std::optional<Vec3> LookUpBead(const TracedView& view, const Disc& disc) {
  const auto at = view.camera.Project(disc.point);
  if (!at) return std::nullopt;
  const int x = int(std::floor(at->x())), y = int(std::floor(at->y()));
  if (!view.parts.Contains(x, y) || view.parts(x, y) < 0) return std::nullopt;
  if (std::abs(view.truth.depth(x, y) - at->z()) > 2 * disc.rod) return std::nullopt;
  const auto& photo = view.truth.photo;
  return Vec3(photo(x, y, 0), photo(x, y, 1), photo(x, y, 2));
}

// Writes the SH coefficients [16, 3] of a disc: least squares over its visible colors in the views.
// A ridge pulls the higher degrees to zero if no view determines them.
void FitColor(const World& world, const Lighting& lighting, const std::vector<TracedView>& views,
              const Disc& disc, float* sh) {
  const bool glossy = world.MaterialOf(disc.part).specular > 0;
  using Matrix = Eigen::Matrix<double, kMaxShCoeffs, kMaxShCoeffs>;
  using Columns = Eigen::Matrix<double, kMaxShCoeffs, 3>;
  Matrix normal_matrix = Matrix::Zero();
  Columns right = Columns::Zero();
  const auto add = [&](const Vec3& direction, const Vec3& color, double weight) {
    Eigen::Matrix<double, kMaxShCoeffs, 1> basis;
    ShBasis(3, direction.x(), direction.y(), direction.z(), basis.data());
    normal_matrix.selfadjointView<Eigen::Lower>().rankUpdate(basis, weight);
    right += weight * basis * (color - Vec3::Constant(0.5)).transpose();
  };
  const auto traced = [&](const Vec3& direction) {
    return lighting.Encoded(disc.hit, disc.surface, direction);
  };
  double total = 0;
  for (const TracedView& view : views) {
    const Vec3 place = disc.rod > 0 ? disc.point : disc.surface;
    const Vec3 direction = (place - view.camera.Center()).normalized();
    const auto spot = disc.rod > 0 ? std::nullopt : VisibleSpot(view, disc);
    const auto color = disc.rod > 0 ? LookUpBead(view, disc)
                       : spot       ? LookUp(view, disc.part, *spot)
                                    : std::nullopt;
    if (!color && !spot) continue;
    add(direction, color ? *color : traced(direction), color ? 1 : 0.3);
    total += 1;
  }
  if (glossy || total == 0) {
    // Faintly over its whole front, so that highlights stay sane from everywhere.
    const Vec3 other = disc.Across();
    constexpr int kAround = 24;
    for (int k = 0; k < kAround; ++k) {
      const double cosine = (k + 0.5) / kAround, sine = std::sqrt(1 - cosine * cosine);
      const double phi = 2.39996 * k;
      const Vec3 direction =
          -(cosine * disc.normal + sine * std::cos(phi) * disc.axis + sine * std::sin(phi) * other);
      add(direction, traced(direction), 0.06);
    }
  }
  const double ridge = (glossy ? 3e-4 : kRidge) * std::max(1.0, total);
  for (int k = 0; k < kMaxShCoeffs; ++k) normal_matrix(k, k) += k == 0 ? 1e-9 : ridge;
  const Columns solution = normal_matrix.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  for (int k = 0; k < kMaxShCoeffs; ++k) {
    for (int c = 0; c < 3; ++c) sh[3 * k + c] = float(solution(k, c));
  }
}

// Slides the disc along the sight line from the middle of the cameras and keeps its size there.
void Stretch(const Vec3& eye, double stretch, Disc* disc) {
  disc->point = eye + stretch * (disc->point - eye);
  for (double& sigma : disc->sigma) sigma *= stretch;
}

// On a textureless wall nothing tells the depth: slide the disc by a smoothly varying share, less
// near the wall's border.
void Misplace(const World& world, const Vec3& eye, double bias, uint64_t seed, Disc* disc) {
  const TexturePoint at = world.Locate(disc->hit, disc->point);
  const Vec2 size =
      at.uv.cwiseMin(Vec2::Ones() - at.uv)
          .cwiseProduct(world.parts[size_t(disc->part)].shape->chart_sizes[size_t(at.chart)]);
  const double taper = Smooth(0.02, 0.30, size.minCoeff());
  const double wave =
      0.25 + 0.75 * Smooth(0.25, 0.75, Noise(at.chart_xy.x() * 2.2, at.chart_xy.y() * 2.2, seed));
  Stretch(eye, 1 + bias * taper * wave, disc);
}

// The flaws that options ask for on every surface. The wave has crests 0.12 m apart: several on an
// object. `index` is the disc's.
void Displace(const World& world, const Vec3& eye, const SyntheticOptions& options, size_t index,
              Disc* disc) {
  if (options.depth_wave == 0 && options.depth_noise == 0) return;
  const TexturePoint at = world.Locate(disc->hit, disc->point);
  const double wave =
      2 * Noise(at.chart_xy.x() / 0.06, at.chart_xy.y() / 0.06,
                HashOf(options.seed, 23, uint64_t(disc->part), uint64_t(at.chart))) -
      1;
  Random random(HashOf(options.seed, 24, index));
  // Four standard deviations at most, so that nothing comes near the cameras.
  const double noise = std::clamp(random.Gaussian(), -4.0, 4.0);
  Stretch(eye, std::max(0.1, 1 + options.depth_wave * wave + options.depth_noise * noise), disc);
}

void Write(size_t i, const Vec3& mean, const Vec3& scales, const Eigen::Quaterniond& q,
           double opacity, GaussianModel* model) {
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  std::copy_n(wxyz, 4, &model->quats_wxyz[4 * i]);
  for (size_t c = 0; c < 3; ++c) {
    model->means[3 * i + c] = float(mean[Eigen::Index(c)]);
    model->log_scales[3 * i + c] = float(std::log(scales[Eigen::Index(c)]));
  }
  model->opacity_logits[i] = float(std::log(opacity / (1 - opacity)));
}

void AppendFloaters(const std::vector<TracedView>& views, const SyntheticOptions& options,
                    GaussianModel* model) {
  const size_t first = model->NumGaussians();
  model->Resize(first + size_t(options.floaters), 3);
  Random random(HashOf(options.seed, 21));
  for (size_t i = first; i < model->NumGaussians(); ++i) {
    // Part of the way from a camera to something it sees.
    const TracedView& view = views[size_t(random.Uniform() * double(views.size()))];
    const int x = int(random.Uniform() * view.parts.width);
    const int y = int(random.Uniform() * view.parts.height);
    const double z = std::max(1.0, double(view.truth.depth(x, y))) * random.Uniform(0.45, 0.9);
    const Eigen::Quaterniond q = Eigen::Quaterniond(random.Gaussian(), random.Gaussian(),
                                                    random.Gaussian(), random.Gaussian())
                                     .normalized();
    Vec3 scales;
    for (int c = 0; c < 3; ++c) {
      scales[c] = 0.012 + 0.03 * random.Uniform();
      model->sh[i * 48 + size_t(c)] =
          float((view.truth.photo(x, y, c) + random.Uniform(-0.1, 0.1) - 0.5) / kShC0);
    }
    Write(i, PixelRay(view.camera, x, y).At(z), scales, q,
          random.Uniform(0.02, options.floater_opacity), model);
  }
}

}  // namespace

GaussianModel MakeGaussians(const World& world, const Lighting& lighting,
                            const std::vector<TracedView>& views, const SyntheticOptions& options,
                            Monitor& monitor) {
  monitor.Step("gaussians", 0, 1);
  auto seeds = CollectSeeds(world, views, HashOf(options.seed, 20));
  monitor.Step("gaussians", 0.25, 1);
  ParallelTasks(int64_t(seeds.size()), [&](size_t p) { seeds[p] = Thin(std::move(seeds[p])); });
  monitor.Step("gaussians", 0.5, 1);

  std::vector<Disc> discs;
  const Vec3 eye = MiddleOfCameras(views);
  for (size_t part = 0; part < seeds.size(); ++part) {
    std::vector<std::optional<Disc>> of_part(seeds[part].size());
    ParallelTasks(int64_t(of_part.size()), [&](size_t i) {
      of_part[i] = MakeDisc(world, views, seeds[part][i], int(part));
    });
    for (const auto& disc : of_part) {
      if (disc) discs.push_back(*disc);
    }
  }
  monitor.Step("gaussians", 0.75, 1);

  const Silhouettes silhouettes(world, views);
  std::vector<std::optional<Disc>> fillers(discs.size());
  ParallelTasks(int64_t(discs.size()), [&](size_t i) {
    silhouettes.KeepInside(&discs[i]);
    fillers[i] = MakeFiller(world, discs[i]);
    if (!fillers[i]) return;
    silhouettes.KeepInside(&*fillers[i]);
    if (!silhouettes.Hides(*fillers[i])) fillers[i].reset();
  });
  for (const auto& filler : fillers) {
    if (filler) discs.push_back(*filler);
  }
  GaussianModel model;
  model.Resize(discs.size(), 3);
  ParallelTasks(int64_t(discs.size()), [&](size_t i) {
    Disc& disc = discs[i];
    FitColor(world, lighting, views, disc, &model.sh[i * size_t(kMaxShCoeffs) * 3]);
    if (world.MaterialOf(disc.part).textureless) {
      Misplace(world, eye, options.wall_bias, HashOf(options.seed, 22), &disc);
    }
    Displace(world, eye, options, i, &disc);
    Eigen::Matrix3d axes;
    axes << disc.axis, disc.Across(), disc.normal;
    Write(i, disc.point, {disc.sigma[0], disc.sigma[1], disc.Thickness()},
          Eigen::Quaterniond(axes).normalized(), kOpacity, &model);
  });
  AppendFloaters(views, options, &model);
  monitor.Step("gaussians", 1, 1);
  return model;
}

}  // namespace retint::synthetic
