// SPDX-License-Identifier: BSD-3-Clause
#include "editing/edit_session.h"

#include "base/error.h"
#include "editing/edited_levels.h"
#include "opening/scene_check.h"
#include "selecting/selection_files.h"
#include "splat_io/streamed_sog.h"

namespace retint {

std::unique_ptr<EditSession> EditSession::Open(const std::filesystem::path& workspace,
                                               const std::filesystem::path& splat,
                                               const SessionOptions& options, Monitor& monitor) {
  return std::make_unique<EditSession>(OpenScene::Open(workspace, splat, options, monitor));
}

EditSession::EditSession(std::unique_ptr<OpenScene> scene)
    : scene_(std::move(scene)),
      selection_(*scene_),
      store_(*scene_),
      warnings_(scene_->workspace().warnings),
      refits_(*scene_, store_) {
  const std::vector<std::string>& notes = scene_->original().source.notes;
  warnings_.insert(warnings_.end(), notes.begin(), notes.end());
  const auto& part = scene_->part();
  const std::string colors =
      WarningOfColors(scene_->original(), part ? std::span<const uint32_t>(part->records)
                                               : std::span<const uint32_t>());
  if (!colors.empty()) warnings_.push_back(colors);
}

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

void EditSession::WriteSplat(const std::filesystem::path& path, Monitor& monitor) const {
  if (IsStreamedSog(path) && IsStreamedSog(scene_->original())) {
    return WriteStreamedSog(path, EditedLevels(*this, monitor), monitor);
  }
  scene_->WriteSplat(path, refits_.CurrentSh(), monitor);
}

void EditSession::WriteMasks(const std::filesystem::path& folder, RegionId id, Monitor& monitor,
                             MaskNames names) const {
  const auto& masks = store_.Require(id).selection->masks;
  const Pictures shown = scene_->pictures();
  if (shown.AreViews()) return retint::WriteMasks(folder, masks, monitor, names);
  retint::WriteMasks(folder, shown.FromViews(masks), monitor, names);
}

}  // namespace retint
