// SPDX-License-Identifier: BSD-3-Clause
#include "opening/align.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <system_error>

#include <Eigen/Cholesky>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/nerfstudio.h"
#include "opening/point_registration.h"
#include "opening/scene_shape.h"
#include "render/renderer.h"
#include "scene/transform.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

// One photo at every level of detail, and where it was taken, in the world. Without photos, the
// colors of the sparse points that the view saw, and NaN elsewhere.
struct Target {
  Rigid3d cam_from_world;
  std::vector<ReducedPhoto> levels;  // coarse first
};

ReducedPhoto PointsSeen(const Reconstruction& model, const View& view, const Camera& camera,
                        int step) {
  ReducedPhoto seen = Reduced(Image(camera.width, camera.height), camera, step);
  Image& picture = seen.photo;
  std::fill(picture.data.begin(), picture.data.end(), float(kNothing));
  for (const Observation& observation : view.observations) {
    if (observation.point_id == kInvalidPointId) continue;
    const auto& color = model.points.at(observation.point_id).color;
    const int x = int(std::floor(observation.xy.x() / step)),
              y = int(std::floor(observation.xy.y() / step));
    if (!picture.Contains(x, y)) continue;
    for (int c = 0; c < 3; ++c) picture(x, y, c) = float(color[c]) / 255;
  }
  return seen;
}

constexpr int kLevelSteps[] = {4, 2, 1};  // of the finest level

// Of `most` of the views, evenly spread.
std::vector<Target> ReadTargets(const Workspace& workspace, const std::vector<const View*>& views,
                                size_t most, int longest_side, Monitor& monitor) {
  const Reconstruction& model = workspace.reconstruction;
  std::vector<Target> targets;
  const size_t count = std::min(views.size(), most);
  for (size_t k = 0; k < count; ++k) {
    monitor.Step("align", 0, 1);
    const View& view = *views[k * views.size() / count];
    const PosedCamera posed = model.Posed(view);
    const int longest = std::max(posed.camera.width, posed.camera.height);
    const int step = std::max(1, longest / longest_side);
    const bool has_photo = workspace.HasPhoto(view);
    const Image photo = has_photo ? workspace.ReadPhoto(view) : Image();
    Target target{posed.cam_from_world, {}};
    for (const int coarser : kLevelSteps) {
      target.levels.push_back(has_photo ? Reduced(photo, posed.camera, step * coarser)
                                        : PointsSeen(model, view, posed.camera, step * coarser));
    }
    if (!target.levels.front().photo.Empty()) targets.push_back(std::move(target));
  }
  return targets;
}

// Renders of the splat as a similarity puts the photos' cameras around it.
class Comparison {
 public:
  Comparison(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
             std::vector<Target> targets, Monitor& monitor)
      : renderer_(backend, model, {.cache_bytes = 0}),
        targets_(std::move(targets)),
        monitor_(monitor) {
    const SceneShape shape = MeasureShape(model);
    center_ = shape.center;
    unit_ = shape.inner_radius;
  }

  bool Empty() const { return targets_.empty(); }
  // How many calls of Refine() make up all of the work.
  void Expect(int refinements) { refinements_ = refinements; }

  // Mean PSNR, dB.
  double Psnr(const Sim3d& splat_from_world, size_t level) {
    double sum = 0;
    for (const Target& target : targets_) {
      const RenderOutput output = Render(target, splat_from_world, level, false);
      double squares = 0;
      const std::vector<float>& photo = target.levels[level].photo.data;
      for (size_t i = 0; i < photo.size(); ++i) {
        squares += std::pow(double(std::clamp(output.rgb.data[i], 0.0F, 1.0F) - photo[i]), 2);
      }
      sum += -10 * std::log10(std::max(squares / double(photo.size()), 1e-10));
    }
    return sum / double(targets_.size());
  }

  // The similarity that moves the scene's center as `splat_from_world` does, and does nothing else.
  Sim3d TranslationOf(const Sim3d& splat_from_world) const {
    Sim3d moved;
    moved.translation = center_ - splat_from_world.Inverse() * center_;
    return moved;
  }

  // At least as good as `start` by the robust differences at `level`. Of the seven parameters the
  // first `free` are refined: 3 are a translation alone.
  Sim3d Refine(Sim3d start, size_t level, int rounds, int free = 7) {
    double damping = 1e-3;
    System at = Linearize(start, level);
    for (int round = 0; round < rounds && damping < 1e6; ++round) {
      monitor_.Step("align", refined_ + double(round) / rounds, refinements_);
      Matrix7d damped = at.matrix;
      for (int k = 0; k < 7; ++k) damped(k, k) += damping * (at.matrix(k, k) + 1e-9);
      Vector7d step = Vector7d::Zero();
      step.head(free) = -damped.topLeftCorner(free, free).ldlt().solve(at.gradient.head(free));
      if (!step.allFinite()) break;
      const Sim3d moved = Compose(Motion(step), start);
      const System next = Linearize(moved, level);
      if (next.cost < at.cost) {
        const bool done = at.cost - next.cost < 1e-5 * at.cost;
        start = moved;
        at = next;
        damping = std::max(damping / 5, 1e-7);
        if (done) break;
      } else {
        damping *= 8;
      }
    }
    ++refined_;
    return start;
  }

 private:
  struct System {
    Matrix7d matrix = Matrix7d::Zero();
    Vector7d gradient = Vector7d::Zero();
    double cost = 0;  // mean over pixels
  };

  RenderOutput Render(const Target& target, const Sim3d& splat_from_world, size_t level,
                      bool depth) {
    monitor_.ThrowIfCancelled();
    RenderRequest request;
    request.depth_expected = request.alpha = depth;
    request.cache = false;
    return renderer_.Render(Posed(target, splat_from_world, level), request);
  }

  static PosedCamera Posed(const Target& target, const Sim3d& splat_from_world, size_t level) {
    Reconstruction moved;
    moved.views[1].cam_from_world = target.cam_from_world;
    Transform(splat_from_world, moved);
    return {target.levels[level].camera, moved.views[1].cam_from_world};
  }

  // A small motion of the cameras in the splat's frame: translation in units of the scene's size,
  // rotation vector and log scale about its center.
  Sim3d Motion(const Vector7d& step) const {
    const Vector3d turn = step.segment<3>(3);
    Sim3d motion;
    motion.scale = std::exp(std::clamp(step[6], -0.5, 0.5));
    if (turn.norm() > 0) {
      motion.rotation = Eigen::AngleAxisd(std::min(turn.norm(), 0.5), turn.normalized());
    }
    motion.translation =
        center_ + unit_ * step.head<3>() - motion.scale * (motion.rotation * center_);
    return motion;
  }

  // Moving the cameras by Motion(step) moves the scene that they see the other way: point X moves
  // by -(unit t + w x (X - c) + s (X - c)). The picture at its pixel then changes by minus its
  // gradient times the pixel's motion.
  System Linearize(const Sim3d& splat_from_world, size_t level) {
    constexpr double kHuber = 0.1;
    constexpr float kOpaque = 0.5F;
    System system;
    double pixels = 0;
    for (const Target& target : targets_) {
      const PosedCamera posed = Posed(target, splat_from_world, level);
      const RenderOutput output = Render(target, splat_from_world, level, true);
      const Image& photo = target.levels[level].photo;
      const Eigen::Matrix3d rotation = posed.cam_from_world.rotation.toRotationMatrix();
      const double fx = posed.camera.fx(), fy = posed.camera.fy();
      for (int y = 0; y < photo.height; ++y) {
        for (int x = 0; x < photo.width; ++x) {
          if (std::isnan(photo(x, y, 0))) continue;
          pixels += 1;
          Eigen::Matrix<double, 2, 7> flow = Eigen::Matrix<double, 2, 7>::Zero();
          const double z = output.depth_expected(x, y);
          const bool inner = x > 0 && y > 0 && x + 1 < photo.width && y + 1 < photo.height;
          const bool moves = inner && z > 0 && output.alpha(x, y) > kOpaque;
          if (moves) {
            const Vector3d point = posed.Unproject({x + 0.5, y + 0.5}, z);
            const Vector3d in_cam = posed.cam_from_world * point, arm = point - center_;
            Eigen::Matrix<double, 2, 3> project;
            project << fx / z, 0, -fx * in_cam.x() / (z * z), 0, fy / z, -fy * in_cam.y() / (z * z);
            const Eigen::Matrix<double, 2, 3> by_point = project * rotation;
            flow.leftCols<3>() = unit_ * by_point;
            for (int k = 0; k < 3; ++k) flow.col(3 + k) = by_point * Vector3d::Unit(k).cross(arm);
            flow.col(6) = by_point * arm;
          }
          for (int c = 0; c < 3; ++c) {
            const double residual = double(output.rgb(x, y, c)) - double(photo(x, y, c));
            const double size = std::abs(residual);
            const double weight = size <= kHuber ? 1 : kHuber / size;
            system.cost += size <= kHuber ? 0.5 * size * size : kHuber * (size - 0.5 * kHuber);
            if (!moves) continue;
            const Eigen::RowVector2d gradient(
                0.5 * double(output.rgb(x + 1, y, c) - output.rgb(x - 1, y, c)),
                0.5 * double(output.rgb(x, y + 1, c) - output.rgb(x, y - 1, c)));
            const Vector7d row = (gradient * flow).transpose();
            system.matrix += weight * row * row.transpose();
            system.gradient += weight * residual * row;
          }
        }
      }
    }
    pixels = std::max(pixels, 1.0);
    system.matrix /= pixels;
    system.gradient /= pixels;
    system.cost /= pixels;
    return system;
  }

  Renderer renderer_;
  std::vector<Target> targets_;
  Monitor& monitor_;
  Vector3d center_;
  double unit_ = 1;
  int refined_ = 0, refinements_ = 1;
};

struct Start {
  Sim3d splat_from_world;
  std::string source;
  double psnr = kNothing;
};

std::vector<Start> Starts(const Workspace& workspace, const GaussianModel& model,
                          const std::vector<fs::path>& files, const Sim3d& given,
                          Monitor& monitor) {
  constexpr size_t kFromPoints = 8;
  std::vector<Start> starts = {
      {given.Inverse(), IsIdentity(given) ? "identity" : "given", kNothing}};
  for (const fs::path& file : files) {
    starts.push_back({ReadWorldFromSplat(file).Inverse(), file.string(), kNothing});
  }
  for (const RegisteredCloud& one :
       RegisterClouds(CloudOf(workspace.reconstruction), CloudOf(model), kFromPoints, monitor)) {
    starts.push_back({one.to_from_from, "points", kNothing});
  }
  return starts;
}

AlignResult ByPhotos(Comparison& comparison, std::vector<Start> starts) {
  constexpr int kCoarseRounds = 12, kRounds = 15;
  constexpr size_t kRefined = 5, kFinished = 2;
  constexpr double kNothingInCommon = 9;  // dB: below the PSNR of a single color for all
  const size_t finest = std::size(kLevelSteps) - 1;
  const Start given = starts.front();
  AlignResult result;
  result.psnr_before = comparison.Psnr(given.splat_from_world, finest);
  const auto rank = [&] {
    for (Start& start : starts) start.psnr = comparison.Psnr(start.splat_from_world, 0);
    std::stable_sort(starts.begin(), starts.end(),
                     [](const Start& a, const Start& b) { return a.psnr > b.psnr; });
  };
  rank();
  starts.resize(std::min(starts.size(), kRefined));
  const size_t finished = std::min(kFinished, starts.size());
  comparison.Expect(int(starts.size() + finished * finest + 1 + finest));
  for (Start& start : starts) {
    start.splat_from_world = comparison.Refine(start.splat_from_world, 0, kCoarseRounds);
  }
  rank();
  Start best;
  for (size_t k = 0; k < finished; ++k) {
    Start& start = starts[k];
    for (size_t level = 1; level <= finest; ++level) {
      start.splat_from_world = comparison.Refine(start.splat_from_world, level, kRounds);
    }
    start.psnr = comparison.Psnr(start.splat_from_world, finest);
    if (k == 0 || start.psnr > best.psnr) best = start;
  }
  // Sparse points are few and rough, and small renders a little wider than small photos: both turn
  // and scale a scene that was only moved. So where a translation alone does as well, it is that.
  constexpr double kAsWell = 0.3;  // dB
  Start moved{comparison.TranslationOf(best.splat_from_world), best.source, kNothing};
  for (size_t level = 0; level <= finest; ++level) {
    moved.splat_from_world = comparison.Refine(moved.splat_from_world, level, kRounds, 3);
  }
  moved.psnr = comparison.Psnr(moved.splat_from_world, finest);
  if (moved.psnr > best.psnr - kAsWell) best = moved;
  if (!(best.psnr > kNothingInCommon)) {
    throw InputError(
        "no similarity was found at which renders and photos have anything in "
        "common: the splat seems to be of another scene");
  }
  result.world_from_splat = best.splat_from_world.Inverse();
  result.source = best.source;
  result.psnr_after = best.psnr;
  if (!(result.psnr_after > result.psnr_before)) {
    result.world_from_splat = given.splat_from_world.Inverse();
    result.source = given.source;
    result.psnr_after = result.psnr_before;
  }
  return result;
}

AlignResult ByPoints(Comparison& comparison, const Start& start) {
  constexpr int kRounds = 10;
  constexpr size_t kFinest = std::size(kLevelSteps) - 1;
  Sim3d splat_from_world = start.splat_from_world;
  comparison.Expect(int(kFinest));
  for (size_t level = 1; level <= kFinest; ++level) {
    splat_from_world = comparison.Refine(splat_from_world, level, kRounds);
  }
  return {splat_from_world.Inverse(), start.source, kNothing, kNothing};
}

}  // namespace

ReducedPhoto Reduced(const Image& photo, const Camera& camera, int step) {
  Image small(photo.width / step, photo.height / step);
  const float weight = 1.0F / float(step * step);
  for (int y = 0; y < small.height * step; ++y) {
    for (int x = 0; x < small.width * step; ++x) {
      for (int c = 0; c < 3; ++c) small(x / step, y / step, c) += weight * photo(x, y, c);
    }
  }
  const Camera of_small =
      Camera::Pinhole(1, small.width, small.height, camera.fx() / step, camera.fy() / step,
                      camera.cx() / step, camera.cy() / step);
  return {std::move(small), of_small};
}

std::vector<fs::path> FindTransformFiles(const fs::path& workspace, const fs::path& splat) {
  std::vector<fs::path> files;
  for (fs::path folder : {fs::absolute(splat).lexically_normal().parent_path(),
                          (fs::absolute(workspace) / "").lexically_normal().parent_path()}) {
    for (int up = 0; up < 3; ++up, folder = folder.parent_path()) {
      const fs::path file = folder / "dataparser_transforms.json";
      const bool known = std::find(files.begin(), files.end(), file) != files.end();
      if (!known && IsFile(file)) files.push_back(file);
    }
  }
  return files;
}

AlignResult Align(const std::shared_ptr<Backend>& backend, const Workspace& workspace,
                  const GaussianModel& model, const std::vector<fs::path>& files,
                  const AlignOptions& options, Monitor& monitor) {
  CheckOption(options.views >= 1, "the number of views to compare must be at least 1");
  CheckOption(options.longest_side >= 32, "pictures must be at least 32 pixels long");
  constexpr size_t kViewsForAPhoto = 2;  // points say less
  const std::vector<const View*> views = workspace.reconstruction.ViewsByName();
  std::vector<const View*> photos;
  std::ranges::copy_if(views, std::back_inserter(photos),
                       [&](const View* view) { return workspace.HasPhoto(*view); });
  const size_t most = size_t(options.views) * (photos.empty() ? kViewsForAPhoto : 1);
  Comparison comparison(
      backend, model,
      ReadTargets(workspace, photos.empty() ? views : photos, most, options.longest_side, monitor),
      monitor);
  std::vector<Start> starts = Starts(workspace, model, files, options.given, monitor);
  if (!photos.empty() && !comparison.Empty()) return ByPhotos(comparison, std::move(starts));
  // A file says it outright; of the points' candidates the first is the best.
  const size_t best = 1;
  if (starts.size() <= best) {
    throw InputError(workspace.root,
                     "has neither photos nor sparse points enough to align a splat by");
  }
  return ByPoints(comparison, starts[best]);
}

}  // namespace retint
