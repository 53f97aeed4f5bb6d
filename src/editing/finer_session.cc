// SPDX-License-Identifier: BSD-3-Clause
#include "editing/finer_session.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "base/error.h"
#include "editing/compare_pictures.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

// A Gaussian of which paint covers less stays as it is: the paint is not seen on it.
constexpr float kLeastPaint = 0.02f;
constexpr double kLargePixels = 3;

// Of the layers that the edit has now; null: it has none.
const GaussianPaint* PaintOf(const Region& region) {
  for (const ColorOperation& op : region.edit.operations) {
    if (op.picture && region.paint && region.paint->IsOf(*op.picture)) return region.paint.get();
  }
  return nullptr;
}

std::vector<float> SharesToSplit(const Region& region) {
  const std::vector<float>& shares = region.selection->shares;
  const GaussianPaint* const paint = PaintOf(region);
  if (!paint) return shares;
  std::vector<float> painted(shares.size(), 0.0f);
  for (const PaintedGaussian& gaussian : paint->gaussians) {
    const auto g = static_cast<size_t>(gaussian.index);
    if (gaussian.alpha >= kLeastPaint) painted[g] = shares[g];
  }
  return painted;
}

// The world's length of a pixel where a view shows a point; the least of these views'. 0: none
// does.
double PixelAt(const Eigen::Vector3d& point, const std::vector<PosedCamera>& cameras) {
  double least = 0;
  for (const PosedCamera& camera : cameras) {
    const auto at = camera.Project(point);
    if (!at) continue;
    const double pixel = (*at)[2] / std::max(camera.camera.fx(), camera.camera.fy());
    least = least == 0 ? pixel : std::min(least, pixel);
  }
  return least;
}

// The region in the finer scene, in which each part has the share of its parent.
Region Carried(const Region& region, const std::vector<int32_t>& parents) {
  Region carried = region;
  carried.fit = nullptr;
  carried.paint = nullptr;  // found again
  auto selection = std::make_shared<RegionSelection>(*region.selection);
  selection->shares.clear();
  for (const int32_t g : parents) {
    selection->shares.push_back(region.selection->shares[static_cast<size_t>(g)]);
  }
  carried.selection = std::move(selection);
  return carried;
}

}  // namespace

Refinement RefineRegion(EditSession& session, RegionId id, const RefineOptions& options,
                        Monitor& monitor) {
  CheckOption(!session.scene().part(),
              "a splat that is opened in parts cannot have its Gaussians split");
  const Region& region = session.store().Require(id);
  session.scene().renderer().SetSh(session.scene().original().sh);
  const StageClock::Lap lap(session.scene().clock(), "refine");
  return RefineGaussians(session.scene().renderer(), session.scene().original(),
                         RenderTargets(session.scene().reconstruction(), region.selection->masks,
                                       session.scene().train_views()),
                         SharesToSplit(region), options, monitor);
}

std::unique_ptr<EditSession> WithFinerGaussians(const EditSession& session, FinerGaussians finer,
                                                const std::filesystem::path& splat,
                                                Monitor& monitor) {
  if (!splat.empty()) WriteSplat(splat, finer.model, monitor);
  RegionSet regions;
  for (const Region& old : session.store().regions().regions) {
    regions.regions.push_back(Carried(old, finer.parents));
  }
  auto made =
      std::make_unique<EditSession>(session.scene().WithModel(std::move(finer.model), splat));
  const std::vector<std::string>& warnings = session.warnings();
  for (size_t i = made->warnings().size(); i < warnings.size(); ++i) made->Warn(warnings[i]);
  made->RestoreRegions(std::move(regions), session.store().job());
  return made;
}

FinerSession MakeFinerSession(EditSession& session, RegionId id, const RefineOptions& options,
                              const std::filesystem::path& splat, Monitor& monitor) {
  Refinement refined = RefineRegion(session, id, options, monitor);
  if (refined.summary.split == 0) return {nullptr, refined.summary};
  return {WithFinerGaussians(session, std::move(refined.finer), splat, monitor), refined.summary};
}

std::string PaintDetail::Problem() const {
  return fmt::format("{:.0f} % of the paint is on Gaussians too large for stripes or letters",
                     100 * on_large);
}

std::string PaintDetail::Gain() const {
  return fmt::format("details would be about {:.0f} times as fine",
                     std::max(2.0, pixels / RefineOptions().pixels));
}

PaintDetail DetailOfPaint(const Region& region, const OpenScene& scene) {
  const GaussianPaint* const paint = PaintOf(region);
  if (!paint) return {};
  const std::vector<PosedCamera> cameras = LayerCameras(region.edit, scene.workspace());
  const GaussianModel& model = scene.original();
  double on_large = 0, all = 0, lengths = 0;
  for (const PaintedGaussian& gaussian : paint->gaussians) {
    const auto g = static_cast<size_t>(gaussian.index);
    const Eigen::Vector3d mean = Eigen::Vector3f(&model.means[3 * g]).cast<double>();
    const double pixel = PixelAt(mean, cameras);
    if (pixel <= 0) continue;
    Eigen::Array3d deviations =
        Eigen::Array3f(Eigen::Array3f::Map(&model.log_scales[3 * g])).cast<double>().exp() / pixel;
    std::sort(deviations.begin(), deviations.end());
    const double opacity = 1 / (1 + std::exp(-static_cast<double>(model.opacity_logits[g])));
    const double shows = gaussian.alpha * opacity * deviations[2] * deviations[1];
    all += shows;
    if (deviations[2] <= kLargePixels) continue;
    on_large += shows;
    lengths += shows * deviations[2];
  }
  if (on_large <= 0) return {};
  return {on_large / all, lengths / on_large};
}

}  // namespace retint
