// SPDX-License-Identifier: BSD-3-Clause
#include "session/edit_session.h"

#include "base/error.h"
#include "colmap_io/image_io.h"
#include "scene/image_checks.h"
#include "session/photo_paint.h"
#include "session/selection_files.h"

namespace retint {

std::unique_ptr<EditSession> EditSession::Open(const std::filesystem::path& workspace,
                                               const std::filesystem::path& splat,
                                               const SessionOptions& options, Monitor& monitor) {
  return std::make_unique<EditSession>(OpenScene::Open(workspace, splat, options, monitor));
}

EditSession::EditSession(std::unique_ptr<OpenScene> scene)
    : scene_(std::move(scene)), selection_(*scene_), store_(*scene_), refits_(*scene_, store_) {}

EditSession::EditSession(Workspace workspace, GaussianModel model, const SessionOptions& options)
    : EditSession(std::make_unique<OpenScene>(std::move(workspace), std::move(model), options)) {}

void EditSession::RestoreRegions(RegionSet regions, const RefitJob& job) {
  try {
    job.Check();
  } catch (const OptionError& error) {
    throw InputError(std::string("refit options: ") + error.what());
  }
  store_.Restore(std::move(regions), job);
}

std::vector<PaintedView> EditSession::ReadBrush(std::string_view picture,
                                                const std::filesystem::path& mask) const {
  const Pictures shown = pictures();
  const UserPicture& one = shown.RequireOne(picture);
  return Brush(one, ReadBrushMask(mask, one.width, one.height), mask);
}

std::vector<PaintedView> EditSession::Brush(const UserPicture& picture, const Mask& mask,
                                            const std::filesystem::path& origin) const {
  const PosedCamera camera = PosedPicture(workspace(), picture);
  std::vector<PaintedView> painted = OnViews(workspace(), PaintedView{picture.name, camera, mask});
  std::erase_if(painted, [](const PaintedView& view) { return !AnySet(view.mask); });
  if (painted.empty()) throw InputError(origin, "only pixels are painted that no ray leads to");
  return painted;
}

RunReport EditSession::MakeReport() const {
  RunReport report = scene_->MakeReport();
  report.refit = refits_.Summary();
  if (regions().regions.size() == 1) report.edit = regions().regions.front().EffectiveEdit();
  return report;
}

void EditSession::WriteSplat(const std::filesystem::path& path, Monitor& monitor) const {
  scene_->WriteSplat(path, CurrentSh(), monitor);
}

void EditSession::WriteMasks(const std::filesystem::path& folder, RegionId id,
                             Monitor& monitor) const {
  const auto& masks = store_.Require(id).selection->masks;
  const Pictures shown = pictures();
  if (shown.AreViews()) return retint::WriteMasks(folder, masks, monitor);
  retint::WriteMasks(folder, shown.FromViews(masks), monitor);
}

}  // namespace retint
