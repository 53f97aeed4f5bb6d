// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/gaussians.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "base/parallel.h"
#include "kernels/common/sh.h"
#include "kernels/common/types.h"
#include "synthetic/discs.h"
#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMaxRing = 18;             // pixels
constexpr double kRadiusPerRing = 0.42;  // a disc's radius per distance to the nearest change
constexpr double kMinRadius = 1.6;       // pixels between neighbors where texture is finest
constexpr double kFineRadius = 1.25;     // the same on what is there to be selected
constexpr float kFlatColor = 0.055f;     // largest change of color that one disc may cover
constexpr float kFlatNormal = 0.985f;    // cosine of the largest change of normal
constexpr double kOpacity = 0.96;
constexpr double kShingle = 1.0;  // offset of what is seen of a disc, in its standard deviations
constexpr double kRidge = 0.02;   // per view, on the higher SH degrees of matt surfaces
constexpr double kLevelRatio = 1.25;  // between levels of world radius

double Logit(double p) { return std::log(p / (1 - p)); }

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
    const int object = world_.parts[size_t(view_.parts(x, y))].object;
    const double least = world_.objects[size_t(object)].furniture ? kMinRadius : kFineRadius;
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
    // Where discs are large, few candidates will do; most views only fill what others miss.
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
        const Vec3 n(view.truth.normals(x, y, 0), view.truth.normals(x, y, 1),
                     view.truth.normals(x, y, 2));
        const double slant =
            std::clamp(std::abs(n.dot(ray.direction)) / ray.direction.norm(), 0.25, 1.0);
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

// Hash table from a cell's key to the first disc in it, -1 for none; open addressing.
class CellTable {
 public:
  void Reset(size_t count) {
    size_t size = 64;
    while (size < 2 * count) size *= 2;
    slots_.assign(size, {0, -1});
  }
  int& At(uint64_t key) {
    Slot& slot = slots_[Locate(key)];
    slot.key = key;
    return slot.head;
  }
  int Find(uint64_t key) const { return slots_[Locate(key)].head; }

 private:
  struct Slot {
    uint64_t key;
    int head;
  };
  size_t Locate(uint64_t key) const {
    size_t i = key & (slots_.size() - 1);
    while (slots_[i].head >= 0 && slots_[i].key != key) i = (i + 1) & (slots_.size() - 1);
    return i;
  }
  std::vector<Slot> slots_;
};

// Poisson-disc selection, finest level first: a candidate stays unless a kept one is nearer than
// the mean of their radii.
std::vector<Seed> Thin(std::vector<Seed> seeds) {
  std::sort(seeds.begin(), seeds.end(), [](const Seed& a, const Seed& b) {
    return a.level != b.level ? a.level < b.level : a.order < b.order;
  });
  std::vector<Seed> kept;
  std::vector<int> next;
  CellTable heads;
  for (size_t begin = 0; begin < seeds.size();) {
    const double radius = seeds[begin].radius, cell = radius;
    const auto cell_of = [&](const Vec3& p) {
      return Eigen::Array3i((p.array() / cell).floor().cast<int>());
    };
    const auto key = [](const Eigen::Array3i& c) {
      return HashOf(uint64_t(uint32_t(c.x())) << 32 | uint32_t(c.y()), uint64_t(uint32_t(c.z())));
    };
    next.assign(kept.size(), -1);
    size_t end_of_level = begin;
    while (end_of_level < seeds.size() && seeds[end_of_level].level == seeds[begin].level) {
      ++end_of_level;
    }
    heads.Reset(kept.size() + end_of_level - begin);
    const auto insert = [&](size_t i) {
      int& head = heads.At(key(cell_of(kept[i].point)));
      next[i] = head;
      head = int(i);
    };
    for (size_t i = 0; i < kept.size(); ++i) insert(i);
    for (size_t candidate = begin; candidate < end_of_level; ++candidate) {
      const Eigen::Array3i home = cell_of(seeds[candidate].point);
      bool covered = false;
      for (int k = 0; k < 27 && !covered; ++k) {
        // The candidate's own cell first: there most of them end.
        const int c = (k + 13) % 27;
        int i = heads.Find(key(home + Eigen::Array3i(c % 3 - 1, c / 3 % 3 - 1, c / 9 - 1)));
        for (; i >= 0 && !covered; i = next[size_t(i)]) {
          const double apart = 0.5 * (kept[size_t(i)].radius + radius);
          covered = (kept[size_t(i)].point - seeds[candidate].point).squaredNorm() < apart * apart;
        }
      }
      if (covered) continue;
      kept.push_back(seeds[candidate]);
      next.push_back(-1);
      insert(kept.size() - 1);
    }
    begin = end_of_level;
  }
  return kept;
}

// Where a disc shows in a view. Neighbors on its near side cover it, it covers those on its far
// side: what is seen of it lies off its center, towards larger depth.
bool VisibleSpot(const TracedView& view, const Disc& disc, double* x, double* y) {
  if (!Sees(view, disc.part, disc.surface, x, y)) return false;
  const Vec3 in_camera = view.camera.cam_from_world * disc.surface;
  const Vec3 normal = view.camera.cam_from_world.rotation * disc.normal;
  const double focal = view.camera.camera.fx(), z = in_camera.z();
  const Vec2 downhill = normal.head<2>();
  if (downhill.norm() < 1e-6) return true;
  const double slant = std::abs(normal.dot(in_camera)) / in_camera.norm();
  const double sigma = std::sqrt(disc.sigma[0] * disc.sigma[1]) * focal / z * slant;
  const Vec2 shift =
      kShingle * std::sqrt(sigma * sigma + kCovarianceDilation) * downhill.normalized();
  *x += shift.x();
  *y += shift.y();
  return true;
}

// Bilinear photo at (x, y), pixel centers at 0.5; false where another part mixes in.
bool LookUp(const TracedView& view, int part, double x, double y, Vec3* color) {
  const double fx = std::floor(x - 0.5), fy = std::floor(y - 0.5);
  const int x0 = int(fx), y0 = int(fy);
  color->setZero();
  for (int k = 0; k < 4; ++k) {
    const int px = x0 + k % 2, py = y0 + k / 2;
    if (!view.parts.Contains(px, py) || view.parts(px, py) != part) return false;
    const double wx = k % 2 ? x - 0.5 - fx : 1 - (x - 0.5 - fx);
    const double wy = k / 2 ? y - 0.5 - fy : 1 - (y - 0.5 - fy);
    for (int c = 0; c < 3; ++c) (*color)[c] += wx * wy * view.truth.photo(px, py, c);
  }
  return true;
}

// The photo where it shows the rod that the bead is on.
bool LookUpBead(const TracedView& view, const Disc& disc, Vec3* color) {
  const auto at = view.camera.Project(disc.point);
  if (!at) return false;
  const int x = int(std::floor(at->x())), y = int(std::floor(at->y()));
  if (!view.parts.Contains(x, y) || view.parts(x, y) < 0) return false;
  if (std::abs(view.truth.depth(x, y) - at->z()) > 2 * disc.rod) return false;
  for (int c = 0; c < 3; ++c) (*color)[c] = view.truth.photo(x, y, c);
  return true;
}

// Writes the SH coefficients [16, 3] of a disc: least squares over the colors that the views show
// where it is seen; a ridge pulls the higher degrees to zero where nothing asks for them.
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
    return lighting.EncodeHere(lighting.Radiance(disc.hit, disc.surface, direction));
  };
  double total = 0;
  for (const TracedView& view : views) {
    double x, y;
    Vec3 color;
    if (disc.rod > 0) {
      if (LookUpBead(view, disc, &color)) {
        add((disc.point - view.camera.Center()).normalized(), color, 1);
        total += 1;
      }
      continue;
    }
    if (!VisibleSpot(view, disc, &x, &y)) continue;
    const Vec3 direction = (disc.surface - view.camera.Center()).normalized();
    if (LookUp(view, disc.part, x, y, &color)) {
      add(direction, color, 1);
    } else {
      add(direction, traced(direction), 0.3);
    }
    total += 1;
  }
  if (glossy || total == 0) {
    // Faintly over its whole front, so that highlights stay sane from everywhere.
    const Vec3 other = disc.normal.cross(disc.axis);
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
          .cwiseProduct(world.parts[size_t(disc->part)].shape->ChartSizes()[size_t(at.chart)]);
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

void Write(const Disc& disc, size_t i, GaussianModel* model) {
  Eigen::Matrix3d axes;
  axes.col(0) = disc.axis;
  axes.col(1) = disc.normal.cross(disc.axis);
  axes.col(2) = disc.normal;
  const Eigen::Quaterniond q = Eigen::Quaterniond(axes).normalized();
  const double thin = Thickness(disc);
  const double scales[3] = {disc.sigma[0], disc.sigma[1], thin};
  for (size_t c = 0; c < 3; ++c) {
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
    model->opacity_logits[i] = float(Logit(random.Uniform(0.02, options.floater_opacity)));
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
    std::vector<Disc> of_part(seeds[part].size());
    std::vector<unsigned char> good(seeds[part].size());
    ParallelTasks(int64_t(of_part.size()), [&](size_t i) {
      good[i] = MakeDisc(world, views, seeds[part][i], int(part), &of_part[i]);
    });
    for (size_t i = 0; i < of_part.size(); ++i) {
      if (good[i]) discs.push_back(of_part[i]);
    }
  }
  monitor.Step("gaussians", 0.75, 1);

  const Silhouettes silhouettes(world, views);
  std::vector<Disc> fillers(discs.size());
  std::vector<unsigned char> filled(discs.size());
  ParallelTasks(int64_t(discs.size()), [&](size_t i) {
    silhouettes.KeepInside(&discs[i]);
    filled[i] = MakeFiller(world, discs[i], &fillers[i]);
    if (!filled[i]) return;
    silhouettes.KeepInside(&fillers[i]);
    filled[i] = silhouettes.Hides(fillers[i]);
  });
  for (size_t i = 0; i < fillers.size(); ++i) {
    if (filled[i]) discs.push_back(fillers[i]);
  }
  GaussianModel model;
  model.Resize(discs.size(), 3);
  ParallelTasks(int64_t(discs.size()), [&](size_t i) {
    FitColor(world, lighting, views, discs[i], &model.sh[i * size_t(kMaxShCoeffs) * 3]);
    if (world.MaterialOf(discs[i].part).textureless) {
      Misplace(world, eye, options.wall_bias, HashOf(options.seed, 22), &discs[i]);
    }
    Displace(world, eye, options, i, &discs[i]);
    Write(discs[i], i, &model);
  });
  AppendFloaters(views, options, &model);
  monitor.Step("gaussians", 1, 1);
  return model;
}

}  // namespace retint::synthetic
