// SPDX-License-Identifier: BSD-3-Clause
// The library's front door, for the command line and the viewer alike. It opens a workspace and a
// splat and hands out the four parts that work on them: the scene, the pipeline that turns painted
// views into a selection, the regions with undo, and the service that refits them. What is used
// everywhere can be called here by a short name; the parts' headers document it.
//
// One thread owns a session and calls it; RefitService says what other threads may call. Every long
// call takes a Monitor, and either finishes or leaves the session as it was.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "scene/gaussian_model.h"
#include "session/fitting/refit_service.h"
#include "session/opening/open_scene.h"
#include "session/pictures/pictures.h"
#include "session/regions/region_store.h"
#include "session/saving/staged_output.h"
#include "session/selecting/selection_pipeline.h"

namespace retint {

class EditSession {
 public:
  // As OpenScene::Open().
  static std::unique_ptr<EditSession> Open(const std::filesystem::path& workspace,
                                           const std::filesystem::path& splat,
                                           const SessionOptions& options, Monitor& monitor);
  explicit EditSession(std::unique_ptr<OpenScene> scene);
  EditSession(Workspace workspace, GaussianModel model, const SessionOptions& options);

  OpenScene& scene() { return *scene_; }
  const OpenScene& scene() const { return *scene_; }
  SelectionPipeline& selection() { return selection_; }
  const SelectionPipeline& selection() const { return selection_; }
  RegionStore& store() { return store_; }
  RefitService& refits() { return refits_; }
  // For people, one line each: the workspace's, what of the splat's file is not used, and what of a
  // saved session could not be read.
  const std::vector<std::string>& warnings() const { return warnings_; }
  void Warn(std::string warning) { warnings_.push_back(std::move(warning)); }

  // For a session just opened, before its first refit: regions that were saved and the job whose
  // fits they hold. InputError when they do not belong to this scene; then nothing is changed.
  void RestoreRegions(RegionSet regions, const RefitJob& job);
  // OpenScene::MakeReport() with the last refit's summary and, of a single region, its edit.
  RunReport MakeReport() const;
  // What the user sees and names, in the pixels of options().pixels.
  Pictures pictures() const { return Pictures(workspace(), options().pixels); }
  // As Pictures::ReadBrush().
  std::vector<PaintedView> ReadBrush(std::string_view picture,
                                     const std::filesystem::path& mask) const {
    return pictures().ReadBrush(picture, mask);
  }
  // The scene as it is now, and <folder>/<picture name>.png of a region's masks.
  void WriteSplat(const std::filesystem::path& path, Monitor& monitor) const;
  void WriteMasks(const std::filesystem::path& folder, RegionId id, Monitor& monitor) const;

  // --- OpenScene -------------------------------------------------------------------------------
  const Workspace& workspace() const { return scene_->workspace(); }
  const Reconstruction& reconstruction() const { return scene_->reconstruction(); }
  const GaussianModel& original() const { return scene_->original(); }
  const SessionOptions& options() const { return scene_->options(); }
  const std::filesystem::path& splat_path() const { return scene_->splat_path(); }
  Renderer& renderer() { return scene_->renderer(); }
  void ShowSh(std::span<const float> sh) { renderer().SetSh(sh); }
  const std::vector<const View*>& train_views() const { return scene_->train_views(); }
  const std::vector<const View*>& heldout_views() const { return scene_->heldout_views(); }

  // --- SelectionPipeline -----------------------------------------------------------------------
  RegionSelection SelectRound(const RegionSelection* base, PaintRound round,
                              const SelectOptions& select, const ProjectorOptions& project,
                              Monitor& monitor) {
    return selection_.SelectRound(base, std::move(round), select, project, monitor);
  }
  Mask SelectionSeenFrom(const RegionSelection& selection, const PosedCamera& camera) {
    return selection_.SeenFrom(selection, camera);
  }

  // --- RegionStore -----------------------------------------------------------------------------
  RegionId AddRegion(std::string name, std::map<std::string, Mask> masks, std::vector<float> shares,
                     const ColorEdit& edit, Monitor& monitor, SelectionSource source = {}) {
    return store_.Add(std::move(name), std::move(masks), std::move(shares), edit, monitor,
                      std::move(source));
  }
  void SetSelection(RegionId id, std::map<std::string, Mask> masks, std::vector<float> shares,
                    Monitor& monitor, SelectionSource source = {}) {
    store_.SetSelection(id, std::move(masks), std::move(shares), monitor, std::move(source));
  }
  RegionId DuplicateRegion(RegionId id) { return store_.Duplicate(id); }
  void SetEdit(RegionId id, const ColorEdit& edit, float strength = 1,
               std::string_view merge_key = "") {
    store_.SetEdit(id, edit, strength, merge_key);
  }
  void SetVisible(RegionId id, bool visible) { store_.SetVisible(id, visible); }
  void Rename(RegionId id, std::string name) { store_.Rename(id, std::move(name)); }
  void MoveRegion(RegionId id, size_t position) { store_.Move(id, position); }
  void RemoveRegion(RegionId id) { store_.Remove(id); }
  const RegionSet& regions() const { return store_.regions(); }
  EditHistory& history() { return store_.history(); }
  bool Undo() { return history().Undo(); }
  bool Redo() { return history().Redo(); }

  // --- RefitService ----------------------------------------------------------------------------
  void Refit(const RefitJob& job, Monitor& monitor) { refits_.Refit(job, monitor); }
  uint64_t StartRefit(const RefitJob& job, Monitor& monitor) { return refits_.Start(job, monitor); }
  BackgroundOptimizer& optimizer() { return refits_.optimizer(); }
  std::shared_ptr<const ShSnapshot> NewestSnapshot() { return refits_.NewestSnapshot(); }
  bool CollectFits() { return refits_.CollectFits(); }
  void DropFits() { refits_.DropFits(); }
  const RefitJob& last_job() const { return store_.job(); }
  FloatArray CurrentSh() const { return refits_.CurrentSh(); }

 private:
  std::unique_ptr<OpenScene> scene_;
  SelectionPipeline selection_;
  RegionStore store_;
  std::vector<std::string> warnings_;
  RefitService refits_;  // last: its thread reads the scene
};

}  // namespace retint
