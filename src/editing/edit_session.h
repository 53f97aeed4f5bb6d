// SPDX-License-Identifier: BSD-3-Clause
// A scene that is being edited: the scene itself, the pipeline that turns painted views into a
// selection, the regions with undo, and the service that refits them. Each part's header documents
// it.
//
// One thread owns a session and calls it; RefitService says what other threads may call. Every long
// call takes a Monitor, and either finishes or leaves the session as it was.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "colmap_io/mask_names.h"
#include "editing/refit_service.h"
#include "editing/region_store.h"
#include "opening/open_scene.h"
#include "scene/gaussian_model.h"
#include "selecting/selection_pipeline.h"

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
  const RegionStore& store() const { return store_; }
  RefitService& refits() { return refits_; }
  const RefitService& refits() const { return refits_; }
  // For people, one line each: the workspace's, and the unused parts of the splat's file and the
  // unreadable ones of a saved session.
  const std::vector<std::string>& warnings() const { return warnings_; }
  void Warn(std::string warning) { warnings_.push_back(std::move(warning)); }

  // For a session just opened, before its first refit: regions that were saved and the job whose
  // fits they hold. InputError when they do not belong to this scene; then nothing is changed.
  void RestoreRegions(RegionSet regions, const RefitJob& job);
  // The scene as it is now, and <folder>/<picture name>.png of a region's masks.
  void WriteSplat(const std::filesystem::path& path, Monitor& monitor) const;
  void WriteMasks(const std::filesystem::path& folder, RegionId id, Monitor& monitor,
                  MaskNames names = MaskNames::kColmap) const;

 private:
  std::unique_ptr<OpenScene> scene_;
  SelectionPipeline selection_;
  RegionStore store_;
  std::vector<std::string> warnings_;
  RefitService refits_;  // last: its thread reads the scene
};

}  // namespace retint
