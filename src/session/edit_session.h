// SPDX-License-Identifier: BSD-3-Clause
// The library's front door, for the command line and the viewer alike: opens a workspace and a
// splat, turns painted views into a selection, holds regions with undo, refits them in the
// foreground or on a thread of its own, and writes the results.
//
// One thread owns a session and calls it. The background optimiser works on copies and renders
// through a Renderer of its own; what it publishes is fetched by NewestSnapshot(), which any thread
// may call. Every long call takes a Monitor, and either finishes or leaves the session as it was.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/monitor.h"
#include "colmap_io/workspace.h"
#include "depth/depth_estimator.h"
#include "recolor/quality_report.h"
#include "render/renderer.h"
#include "scene/gaussian_model.h"
#include "selection/mask_projector.h"
#include "session/background_optimizer.h"
#include "session/checksum.h"
#include "session/history.h"
#include "session/refit_chain.h"
#include "session/region.h"
#include "session/report.h"
#include "session/select_options.h"
#include "session/staged_output.h"

namespace retint {

struct SessionOptions {
  std::string backend = "auto";                        // "auto", "cpu" or "cuda"
  size_t cache_bytes = RendererOptions().cache_bytes;  // of the per-view geometry cache
  size_t history_bytes = size_t{512} << 20;            // of the undo history
  std::array<float, 3> background = {0, 0, 0};         // behind the Gaussians, RGB
  std::filesystem::path image_folder;                  // photos; empty: found in the workspace
  int holdout = 0;  // every n-th view by name is kept out of the fit; 0: none
  void Check() const;
};

// What Select() computed from the painted views, stage by stage.
struct SelectionResult {
  std::vector<DepthEstimate> depths;  // one a painted view
  SelectionCloud cloud_raw;           // every sampled pixel, unfiltered and unregistered
  SelectionCloud cloud;
  std::vector<PaintedReport> painted;
};

class EditSession {
 public:
  // InputError for anything wrong with the files, among them cameras that are not pinhole.
  static std::unique_ptr<EditSession> Open(const std::filesystem::path& workspace,
                                           const std::filesystem::path& splat,
                                           const SessionOptions& options, Monitor& monitor);
  EditSession(Workspace workspace, GaussianModel model, const SessionOptions& options);
  ~EditSession();

  const Workspace& workspace() const { return workspace_; }
  const Reconstruction& reconstruction() const { return workspace_.reconstruction; }
  const GaussianModel& original() const { return model_; }
  const SessionOptions& options() const { return options_; }
  // Of the file that Open() read; empty and invalid for a session made from memory.
  const std::filesystem::path& splat_path() const { return splat_path_; }
  const std::shared_future<FileChecksum>& splat_checksum() const { return splat_checksum_; }
  // Renders whatever coefficients the last call left there; ShowSh() chooses.
  Renderer& renderer() { return *renderer_; }
  void ShowSh(std::span<const float> sh) { renderer_->SetSh(sh); }
  StageClock& clock() { return clock_; }
  const std::vector<const View*>& train_views() const { return train_; }
  const std::vector<const View*>& heldout_views() const { return heldout_; }

  // --- Selection -------------------------------------------------------------------------------

  // A workspace view and the mask painted on it. InputError when there is no such view, the mask is
  // of another size, or no pixel is set.
  PaintedView Paint(std::string_view view_name, Mask mask) const;

  DepthEstimate EstimateDepth(const PosedCamera& view, const SelectOptions& options,
                              Monitor& monitor);
  // Depth, cloud and registration of every painted view; the points of all are one cloud.
  SelectionResult Select(const std::vector<PaintedView>& painted, const SelectOptions& options,
                         Monitor& monitor);
  ProjectedMasks Project(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                         const ProjectorOptions& options, Monitor& monitor);

  // A region's selection after one more round of painting; `base` is the selection so far, null in
  // the first round. Where rounds disagree the newest holds: what it removed or added is removed
  // from or added to the paint of the rounds before, on the surfaces that both see. A view painted
  // again replaces its earlier paint. A view of no name is a free camera and is given one.
  // InputError when nothing is left selected.
  RegionSelection SelectRound(const RegionSelection* base, PaintRound round,
                              const SelectOptions& select, const ProjectorOptions& project,
                              Monitor& monitor);
  // The selection as a soft mask of any camera.
  Mask SelectionSeenFrom(const RegionSelection& selection, const PosedCamera& camera);

  // --- Regions ---------------------------------------------------------------------------------

  // `masks` by image name; `shares` [N] or empty: computed from the masks of the training views.
  // InputError when a name or size fits no view, or no pixel of any mask is set.
  RegionId AddRegion(std::string name, std::map<std::string, Mask> masks, std::vector<float> shares,
                     const ColorEdit& edit, Monitor& monitor, SelectionSource source = {});
  // Another selection for a region, from a later round of painting. The same checks.
  void SetSelection(RegionId id, std::map<std::string, Mask> masks, std::vector<float> shares,
                    Monitor& monitor, SelectionSource source = {});
  // A copy of a region above it, "NAME copy"; shares its selection.
  RegionId DuplicateRegion(RegionId id);
  // Edits of values, each one step of the history (of one `merge_key`: one step together).
  void SetEdit(RegionId id, const ColorEdit& edit, float strength = 1,
               std::string_view merge_key = "");
  void SetVisible(RegionId id, bool visible);
  void Rename(RegionId id, std::string name);
  void MoveRegion(RegionId id, size_t position);  // 0 is applied first
  void RemoveRegion(RegionId id);
  // For a session just opened, before its first refit: starts the history from regions that were
  // saved and the job whose fits they hold. InputError when they do not belong to this scene; then
  // nothing is changed.
  void RestoreRegions(RegionSet regions, const RefitJob& job);
  const RegionSet& regions() const { return history_.current(); }
  EditHistory& history() { return history_; }
  bool Undo() { return history_.Undo(); }
  bool Redo() { return history_.Redo(); }

  // --- Refit -----------------------------------------------------------------------------------

  // Refits every visible region whose fit is out of date, in order, here and now.
  void Refit(const RefitJob& job, Monitor& monitor);
  // The same on the background thread, starting from what is up to date. Snapshots begin with the
  // closed form. Photos, where they are the target, are read before this returns.
  uint64_t StartRefit(const RefitJob& job, Monitor& monitor);
  BackgroundOptimizer& optimizer();
  std::shared_ptr<const ShSnapshot> NewestSnapshot() { return optimizer().Newest(); }
  // Back to the closed forms, as before any refit. Not an edit.
  void DropFits();
  const RefitJob& last_job() const { return last_job_; }
  // Takes over the fits that the background thread has finished and that are still wanted. True
  // when there was one.
  bool CollectFits();

  // The coefficients of the current state, [N, K, 3]: the original's, then each visible region's
  // fit, or where that is out of date its closed form. With no visible region the original's bits.
  std::vector<float> CurrentSh() const;
  // The last refit's summaries: counts summed over the visible regions.
  RefitSummary Summary() const;

  // What a region's edit did between two sets of coefficients, [N, K, 3] each: against its targets
  // on the training and the held-out views; of each at most so many, spread evenly (0: all).
  QualityReport Evaluate(RegionId id, std::span<const float> sh_before,
                         std::span<const float> sh_after, TargetKind target, Monitor& monitor,
                         size_t most_views = 0);
  // One view with these coefficients, and what the visible regions' edits make of it: the original
  // render or the photo with every edit painted over it in order. Not clamped.
  Image RenderView(const View& view, std::span<const float> sh);
  Image EditedTarget(const View& view, TargetKind target);

  // --- Output ----------------------------------------------------------------------------------

  // The scene with CurrentSh(), atomically; everything else of the source file unchanged.
  void WriteSplat(const std::filesystem::path& path, Monitor& monitor) const;
  // <folder>/<image name>.png of a region.
  void WriteMasks(const std::filesystem::path& folder, RegionId id, Monitor& monitor) const;
  // Backend, counts, times and peaks; the stages' own parts are the caller's.
  RunReport MakeReport() const;

 private:
  void SplitViews();
  std::shared_ptr<RegionSelection> MakeSelection(const std::string& name,
                                                 std::map<std::string, Mask> masks,
                                                 std::vector<float> shares, SelectionSource source,
                                                 Monitor& monitor);
  void CheckRegion(const Region& region) const;
  void CheckMasks(const std::map<std::string, Mask>& masks) const;
  void LoadPhotos(Monitor& monitor);
  std::vector<RefitTarget> Targets(const std::map<std::string, Mask>& masks,
                                   const std::vector<const View*>& views, TargetKind target) const;
  RefitChainInput ChainInput(const RefitJob& job, Monitor& monitor);

  Workspace workspace_;
  GaussianModel model_;
  SessionOptions options_;
  std::filesystem::path splat_path_;
  std::shared_future<FileChecksum> splat_checksum_;
  StageClock clock_;
  std::shared_ptr<Backend> backend_;
  std::unique_ptr<Renderer> renderer_;
  std::vector<const View*> train_, heldout_;
  std::map<std::string, Image> photos_;  // read when they are first a target, then never changed
  EditHistory history_;
  RegionId next_region_ = 1;
  uint64_t next_selection_ = 1;
  RefitJob last_job_;
  // Used by the optimiser's thread alone; kept between jobs, whose views are mostly the same.
  std::shared_ptr<std::unique_ptr<Renderer>> background_renderer_;
  std::unique_ptr<BackgroundOptimizer> optimizer_;  // last: its thread reads the rest
};

}  // namespace retint
