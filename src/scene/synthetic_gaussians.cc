// SPDX-License-Identifier: BSD-3-Clause
#include "scene/synthetic_gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include <tbb/parallel_for.h>
#include <Eigen/Cholesky>

#include "kernels/common/sh.h"
#include "kernels/common/types.h"
#include "scene/synthetic_noise.h"

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::array<int, 7> kWindows = {1, 2, 3, 4, 6, 9, 13};  // half sizes, pixels
constexpr double kMinRadius = 1.15;   // pixels between neighbours where texture is finest
constexpr double kFlatColor = 0.022;  // standard deviation in a window that one disc may cover
constexpr double kFlatNormal = 0.10;  // likewise of the normal's components
constexpr double kSigmaPerRadius = 0.85;
constexpr double kOpacity = 0.96;
constexpr double kLevelRatio = 1.25;  // between levels of world radius

double Logit(double p) { return std::log(p / (1 - p)); }

// A place where a disc may go.
struct Seed {
  Vec3 point;
  double radius;  // metres to its neighbours
  uint32_t pixel;
  uint16_t view;
  int16_t level;
  uint64_t order;
};

struct Disc {
  Vec3 point, normal, axis;  // axis: tangent of the first scale
  double sigma[2];
  int part;
  Hit hit;
};

// Largest window half size around every pixel within which colour and normal hardly vary and no
// other part shows.
PixelArray<float, 1> FlatRadius(const TracedView& view) {
  const int width = view.parts.width, height = view.parts.height;
  constexpr int kChannels = 6;
  const auto value = [&](int x, int y, int c) {
    return c < 3 ? double(view.truth.photo(x, y, c))
                 : double(view.truth.normals(x, y, c - 3)) * (kFlatColor / kFlatNormal);
  };
  // Summed-area tables: sums, sums of squares, part edges.
  constexpr int kTables = 2 * kChannels + 1;
  const size_t stride = size_t(width) + 1;
  std::vector<double> table(stride * size_t(height + 1) * kTables, 0.0);
  for (int y = 0; y < height; ++y) {
    double row[kTables] = {};
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < kChannels; ++c) {
        const double v = value(x, y, c);
        row[c] += v;
        row[kChannels + c] += v * v;
      }
      const int part = view.parts(x, y);
      row[2 * kChannels] += (x + 1 < width && view.parts(x + 1, y) != part) ||
                            (y + 1 < height && view.parts(x, y + 1) != part);
      double* out = &table[(size_t(y + 1) * stride + size_t(x) + 1) * kTables];
      const double* above = out - stride * kTables;
      for (int k = 0; k < kTables; ++k) out[k] = above[k] + row[k];
    }
  }
  PixelArray<float, 1> radius(width, height, float(kMinRadius));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const int w : kWindows) {
        const int x0 = std::max(0, x - w), x1 = std::min(width, x + w + 1);
        const int y0 = std::max(0, y - w), y1 = std::min(height, y + w + 1);
        const double* a = &table[(size_t(y0) * stride + size_t(x0)) * kTables];
        const double* b = &table[(size_t(y0) * stride + size_t(x1)) * kTables];
        const double* c = &table[(size_t(y1) * stride + size_t(x0)) * kTables];
        const double* d = &table[(size_t(y1) * stride + size_t(x1)) * kTables];
        const auto sum = [&](int k) { return d[k] - b[k] - c[k] + a[k]; };
        if (sum(2 * kChannels) > 0) break;
        const double n = double(x1 - x0) * double(y1 - y0);
        double variance = 0;
        for (int k = 0; k < kChannels; ++k) {
          const double mean = sum(k) / n;
          variance = std::max(variance, sum(kChannels + k) / n - mean * mean);
        }
        if (variance > kFlatColor * kFlatColor) break;
        radius(x, y) = float(std::max(kMinRadius, 0.8 * w + 0.6));
      }
    }
  }
  return radius;
}

// Candidates of all views, by part.
std::vector<std::vector<Seed>> CollectSeeds(const World& world,
                                            const std::vector<TracedView>& views, uint64_t seed) {
  std::vector<std::vector<std::vector<Seed>>> of_view(views.size());
  tbb::parallel_for(size_t{0}, views.size(), [&](size_t v) {
    const TracedView& view = views[v];
    const auto flat = FlatRadius(view);
    auto& out = of_view[v];
    out.resize(world.parts.size());
    const double focal = view.camera.camera.fx();
    for (int y = 0; y < view.parts.height; ++y) {
      for (int x = 0; x < view.parts.width; ++x) {
        const int part = view.parts(x, y);
        if (part < 0) continue;
        const uint64_t order = HashOf(seed, v, uint64_t(y) << 32 | uint64_t(x));
        // Where discs are large, few candidates will do.
        const double pixels = flat(x, y);
        if (Unit(Mix(order)) > 5 / (pixels * pixels)) continue;
        const double z = view.truth.depth(x, y);
        const Ray ray = PixelRay(view.camera, x + 0.5, y + 0.5);
        const Vec3 n(view.truth.normals(x, y, 0), view.truth.normals(x, y, 1),
                     view.truth.normals(x, y, 2));
        const double slant =
            std::clamp(std::abs(n.dot(ray.direction)) / ray.direction.norm(), 0.25, 1.0);
        const double wanted = pixels * z / focal / std::sqrt(slant);
        const int level = int(std::floor(std::log(wanted) / std::log(kLevelRatio)));
        out[size_t(part)].push_back({ray.origin + z * ray.direction, std::pow(kLevelRatio, level),
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
// its own radius.
std::vector<Seed> Thin(std::vector<Seed> seeds) {
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
    return a.level != b.level ? a.level < b.level : a.order < b.order;
  });
  std::vector<Seed> kept;
  std::unordered_map<uint64_t, int> heads;
  std::vector<int> next;
  for (size_t begin = 0; begin < seeds.size();) {
    const double radius = seeds[begin].radius, cell = radius * 0.57;
    const auto cell_of = [&](const Vec3& p) {
      return Eigen::Array3i((p.array() / cell).floor().cast<int>());
    };
    const auto key = [](const Eigen::Array3i& c) {
      return HashOf(uint64_t(uint32_t(c.x())) << 32 | uint32_t(c.y()), uint64_t(uint32_t(c.z())));
    };
    heads.clear();
    next.assign(kept.size(), -1);
    const auto insert = [&](size_t i) {
      const auto [it, fresh] = heads.try_emplace(key(cell_of(kept[i].point)), int(i));
      if (fresh) return;
      next[i] = it->second;
      it->second = int(i);
    };
    for (size_t i = 0; i < kept.size(); ++i) insert(i);
    size_t end = begin;
    for (; end < seeds.size() && seeds[end].level == seeds[begin].level; ++end) {
      const Eigen::Array3i home = cell_of(seeds[end].point);
      // Points of one cell are nearer to each other than the radius.
      bool covered = heads.count(key(home)) > 0;
      for (int k = 0; k < 125 && !covered; ++k) {
        const auto it =
            heads.find(key(home + Eigen::Array3i(k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2)));
        for (int i = it == heads.end() ? -1 : it->second; i >= 0 && !covered; i = next[size_t(i)]) {
          covered = (kept[size_t(i)].point - seeds[end].point).squaredNorm() < radius * radius;
        }
      }
      if (covered) continue;
      kept.push_back(seeds[end]);
      next.push_back(-1);
      insert(kept.size() - 1);
    }
    begin = end;
  }
  return kept;
}

// The part's surface under a point offset in the tangent plane.
bool Probe(const World& world, int part, const Vec3& point, const Vec3& normal, double height,
           Hit* hit, Vec3* where) {
  const Ray ray = {point + height * normal, -normal};
  if (!world.parts[size_t(part)].shape->Intersect(ray, 0, 2 * height, hit)) return false;
  hit->shape = part;
  *where = ray.origin + hit->t * ray.direction;
  return hit->normal.dot(normal) > 0.5;
}

// A round disc, or near the part's edge one that ends there.
bool MakeDisc(const World& world, const std::vector<TracedView>& views, const Seed& seed, int part,
              Disc* disc) {
  const TracedView& view = views[seed.view];
  const int width = view.parts.width;
  const Ray ray =
      PixelRay(view.camera, seed.pixel % uint32_t(width) + 0.5, seed.pixel / uint32_t(width) + 0.5);
  disc->part = part;
  if (!world.parts[size_t(part)].shape->Intersect(ray, 1e-6, 1e3, &disc->hit)) return false;
  disc->hit.shape = part;
  disc->point = ray.origin + disc->hit.t * ray.direction;
  disc->normal = disc->hit.normal;
  disc->axis = disc->normal.unitOrthogonal();
  const double sigma = kSigmaPerRadius * seed.radius, reach = 1.3 * sigma;
  disc->sigma[0] = disc->sigma[1] = sigma;
  const auto on_surface = [&](const Vec3& offset) {
    Hit hit;
    Vec3 where;
    return Probe(world, part, disc->point + offset, disc->normal, 0.7 * offset.norm() + 1e-4, &hit,
                 &where);
  };
  Vec3 missing = Vec3::Zero();
  const Vec3 other = disc->normal.cross(disc->axis);
  bool edge = false;
  for (int k = 0; k < 8; ++k) {
    const Vec3 direction = std::cos(k * kPi / 4) * disc->axis + std::sin(k * kPi / 4) * other;
    if (on_surface(reach * direction)) continue;
    missing += direction;
    edge = true;
  }
  if (!edge) return true;
  if (missing.norm() > 1e-3) {
    disc->axis = (missing - disc->normal.dot(missing) * disc->normal).normalized();
  }
  Vec3 shift = Vec3::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    const Vec3 direction = axis == 0 ? disc->axis : Vec3(disc->normal.cross(disc->axis));
    double extent[2];
    for (int side = 0; side < 2; ++side) {
      double inside = 0, outside = reach;
      const Vec3 outward = side == 0 ? direction : Vec3(-direction);
      if (on_surface(reach * outward)) inside = reach;
      for (int step = 0; step < 4 && inside < reach; ++step) {
        const double middle = 0.5 * (inside + outside);
        (on_surface(middle * outward) ? inside : outside) = middle;
      }
      extent[side] = inside;
    }
    disc->sigma[axis] = std::max(0.25 * sigma, 0.5 * (extent[0] + extent[1]) / 1.3);
    shift += 0.5 * (extent[0] - extent[1]) * direction;
  }
  Hit hit;
  Vec3 where;
  if (Probe(world, part, disc->point + shift, disc->normal, 0.7 * shift.norm() + 1e-4, &hit,
            &where)) {
    disc->point = where;
    disc->hit = hit;
    disc->axis = (disc->axis - hit.normal.dot(disc->axis) * hit.normal).normalized();
    disc->normal = hit.normal;
  }
  return true;
}

// Writes the SH coefficients [16, 3] of a disc.
void FitColor(const World& world, const Lighting& lighting, const std::vector<TracedView>& views,
              const Disc& disc, float* sh) {
  // Where the disc is looked at: its middle and a ring around it.
  std::vector<std::pair<Hit, Vec3>> places = {{disc.hit, disc.point}};
  const Vec3 other = disc.normal.cross(disc.axis);
  for (int k = 0; k < 6; ++k) {
    const double phi = k * kPi / 3;
    const Vec3 offset =
        0.55 * (std::cos(phi) * disc.sigma[0] * disc.axis + std::sin(phi) * disc.sigma[1] * other);
    Hit hit;
    Vec3 where;
    if (Probe(world, disc.part, disc.point + offset, disc.normal, 0.7 * offset.norm() + 1e-4, &hit,
              &where)) {
      places.emplace_back(hit, where);
    }
  }
  const auto color_towards = [&](const Vec3& direction) {
    Vec3 sum = Vec3::Zero();
    for (const auto& [hit, where] : places) {
      sum += lighting.EncodeHere(lighting.Radiance(hit, where, direction));
    }
    return Vec3(sum / double(places.size()));
  };
  std::fill(sh, sh + kMaxShCoeffs * 3, 0.0f);
  if (world.MaterialOf(disc.part).specular <= 0) {
    const Vec3 color = color_towards(-disc.normal);
    for (int c = 0; c < 3; ++c) sh[c] = float((color[c] - 0.5) / kShC0);
    return;
  }
  // Least squares over the views that see it, and faintly over its whole front, so that the fit
  // stays sane from everywhere; a ridge keeps higher degrees small where nothing asks for them.
  using Matrix = Eigen::Matrix<double, kMaxShCoeffs, kMaxShCoeffs>;
  Matrix normal_matrix = Matrix::Zero();
  Eigen::Matrix<double, kMaxShCoeffs, 3> right = Eigen::Matrix<double, kMaxShCoeffs, 3>::Zero();
  const auto add = [&](const Vec3& direction, double weight) {
    Eigen::Matrix<double, kMaxShCoeffs, 1> basis;
    ShBasis(3, direction.x(), direction.y(), direction.z(), basis.data());
    const Vec3 target = color_towards(direction) - Vec3::Constant(0.5);
    normal_matrix += weight * basis * basis.transpose();
    right += weight * basis * target.transpose();
  };
  for (const TracedView& view : views) {
    double x, y;
    if (Sees(view, disc.part, disc.point, &x, &y)) {
      add((disc.point - view.camera.Center()).normalized(), 1);
    }
  }
  constexpr int kAround = 24;
  for (int k = 0; k < kAround; ++k) {
    const double cosine = (k + 0.5) / kAround, sine = std::sqrt(1 - cosine * cosine);
    const double phi = 2.39996 * k;
    add(-(cosine * disc.normal + sine * std::cos(phi) * disc.axis + sine * std::sin(phi) * other),
        0.06);
  }
  for (int k = 1; k < kMaxShCoeffs; ++k) normal_matrix(k, k) += k < 4 ? 1e-3 : k < 9 ? 3e-3 : 6e-3;
  const Eigen::Matrix<double, kMaxShCoeffs, 3> solution = normal_matrix.ldlt().solve(right);
  for (int k = 0; k < kMaxShCoeffs; ++k) {
    for (int c = 0; c < 3; ++c) sh[3 * k + c] = float(solution(k, c));
  }
}

// On a textureless wall nothing tells the depth: slide the disc along the sight line from the
// middle of the cameras, by a smoothly varying share, less near the wall's border.
void Misplace(const World& world, const Vec3& eye, double bias, uint64_t seed, Disc* disc) {
  const TexturePoint at = world.Locate(disc->hit, disc->point);
  const Vec2 size =
      at.uv.cwiseMin(Vec2::Ones() - at.uv)
          .cwiseProduct(world.parts[size_t(disc->part)].shape->ChartSizes()[size_t(at.chart)]);
  const double taper = Smooth(0.02, 0.30, size.minCoeff());
  const double wave =
      0.25 + 0.75 * Smooth(0.25, 0.75, Noise(at.chart_xy.x() * 2.2, at.chart_xy.y() * 2.2, seed));
  const double stretch = 1 + bias * taper * wave;
  disc->point = eye + stretch * (disc->point - eye);
  for (double& sigma : disc->sigma) sigma *= stretch;
}

void Write(const Disc& disc, size_t i, GaussianModel* model) {
  Eigen::Matrix3d axes;
  axes.col(0) = disc.axis;
  axes.col(1) = disc.normal.cross(disc.axis);
  axes.col(2) = disc.normal;
  const Eigen::Quaterniond q = Eigen::Quaterniond(axes).normalized();
  const double thin = std::max(2e-4, 0.12 * std::min(disc.sigma[0], disc.sigma[1]));
  const double scales[3] = {disc.sigma[0], disc.sigma[1], thin};
  for (size_t c = 0; c < 3; ++c) {
    // Sunk by its thickness, so that its front lies at the surface.
    model->means[3 * i + c] = float(disc.point[Eigen::Index(c)]);
    model->log_scales[3 * i + c] = float(std::log(scales[c]));
  }
  const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
  for (size_t c = 0; c < 4; ++c) model->quats_wxyz[4 * i + c] = float(wxyz[c]);
  model->opacity_logits[i] = float(Logit(kOpacity));
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
    const Ray ray = PixelRay(view.camera, x, y);
    const double z = std::max(1.0, double(view.truth.depth(x, y))) * random.Uniform(0.45, 0.9);
    const Vec3 point = ray.origin + z * ray.direction;
    const Eigen::Quaterniond q = Eigen::Quaterniond(random.Gaussian(), random.Gaussian(),
                                                    random.Gaussian(), random.Gaussian())
                                     .normalized();
    for (size_t c = 0; c < 3; ++c) {
      model->means[3 * i + c] = float(point[Eigen::Index(c)]);
      model->log_scales[3 * i + c] = float(std::log(0.012 + 0.03 * random.Uniform()));
      model->sh[i * 48 + c] =
          float((view.truth.photo(x, y, int(c)) + random.Uniform(-0.1, 0.1) - 0.5) / kShC0);
    }
    const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
    for (size_t c = 0; c < 4; ++c) model->quats_wxyz[4 * i + c] = float(wxyz[c]);
    model->opacity_logits[i] = float(Logit(random.Uniform(0.02, 0.06)));
  }
}

}  // namespace

GaussianModel MakeGaussians(const World& world, const Lighting& lighting,
                            const std::vector<TracedView>& views, const SyntheticOptions& options,
                            Monitor& monitor) {
  monitor.Step("gaussians", 0, 1);
  auto seeds = CollectSeeds(world, views, HashOf(options.seed, 20));
  monitor.Step("gaussians", 0.25, 1);
  tbb::parallel_for(size_t{0}, seeds.size(),
                    [&](size_t p) { seeds[p] = Thin(std::move(seeds[p])); });
  monitor.Step("gaussians", 0.5, 1);

  std::vector<Disc> discs;
  Vec3 eye = Vec3::Zero();
  for (const TracedView& view : views) eye += view.camera.Center() / double(views.size());
  for (size_t part = 0; part < seeds.size(); ++part) {
    std::vector<Disc> of_part(seeds[part].size());
    std::vector<unsigned char> good(seeds[part].size());
    tbb::parallel_for(size_t{0}, of_part.size(), [&](size_t i) {
      good[i] = MakeDisc(world, views, seeds[part][i], int(part), &of_part[i]);
    });
    for (size_t i = 0; i < of_part.size(); ++i) {
      if (good[i]) discs.push_back(of_part[i]);
    }
  }
  monitor.Step("gaussians", 0.75, 1);

  GaussianModel model;
  model.Resize(discs.size(), 3);
  tbb::parallel_for(size_t{0}, discs.size(), [&](size_t i) {
    FitColor(world, lighting, views, discs[i], &model.sh[i * size_t(kMaxShCoeffs) * 3]);
    if (world.MaterialOf(discs[i].part).textureless) {
      Misplace(world, eye, options.wall_bias, HashOf(options.seed, 22), &discs[i]);
    }
    Write(discs[i], i, &model);
  });
  AppendFloaters(views, options, &model);
  monitor.Step("gaussians", 1, 1);
  return model;
}

}  // namespace retint::synthetic
