// SPDX-License-Identifier: BSD-3-Clause
// A workspace and a splat, found, read and ready to render: the base of every part of a session.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "base/checksum.h"
#include "base/input_guard.h"
#include "base/monitor.h"
#include "base/run_clock.h"
#include "colmap_io/workspace.h"
#include "opening/pictures.h"
#include "render/renderer.h"
#include "scene/gaussian_model.h"
#include "splat_io/ply_file.h"

namespace retint {

struct SessionOptions;
// OptionError for one that is not there.
std::shared_ptr<Backend> OpenBackend(const std::string& name);
// The workspace with pinhole views, in the splat's frame.
Workspace OpenWorkspace(const std::filesystem::path& folder, const SessionOptions& options);

struct SessionOptions {
  std::string backend = "auto";                        // "auto", "cpu" or "cuda"
  size_t cache_bytes = RendererOptions().cache_bytes;  // of the per-view geometry cache
  size_t photo_bytes = SIZE_MAX;  // of photos that are targets; further photos are read again
  size_t history_bytes = size_t{512} << 20;     // of the undo history
  std::array<float, 3> background = {0, 0, 0};  // behind the Gaussians, RGB
  std::filesystem::path image_folder;           // photos; empty: found in the workspace
  std::string model;  // folder of the sparse model, below the workspace; empty: the largest
  // The place of the splat in the workspace's world. Cameras, points and depth maps are moved into
  // the splat's frame, so that the splat itself keeps every bit.
  Sim3d world_from_splat;
  std::optional<RenderModel> render_model;  // kDefault or kMip, whatever the files say
  OcioSpace space;                          // of the splat's colors; no name: as the files say
  // Of a splat without a workspace: how many views are placed around it, or the COLMAP model that
  // has them already.
  int views = 40;
  std::filesystem::path view_folder;
  Pixels pixels = Pixels::kPhoto;
  int holdout = 0;  // every n-th photo by name is kept out of the fit; 0: none
  void Check() const;
};

// A part of a splat whose file is larger than memory: the Gaussians that some views may see
// (pipeline/large_scene.h). It has the records in the file of the model's Gaussians, and the views
// from which the part looks like the whole.
struct ScenePart {
  std::shared_ptr<const PlyFile> file;
  std::vector<uint32_t> records;  // [N] of the model's Gaussians, ascending
  std::set<ViewId> views;
  std::shared_ptr<Backend> backend;
};

// One thread owns it. `renderer` shows whatever coefficients were set last. As long as it lives, no
// output replaces a file of its model, a photo, or, except by a splat, its splat.
class OpenScene {
 public:
  // An empty `workspace` is a splat alone: views are placed around it
  // (opening/virtual_views.h). InputError for anything wrong with the files, among them
  // cameras that cannot be undistorted; OptionError for a backend that is not there. Stages:
  // "load", "views".
  static std::unique_ptr<OpenScene> Open(const std::filesystem::path& workspace,
                                         const std::filesystem::path& splat,
                                         const SessionOptions& options, Monitor& monitor);
  OpenScene(Workspace workspace, GaussianModel model, const SessionOptions& options);
  OpenScene(std::shared_ptr<const Workspace> workspace, GaussianModel model,
            const SessionOptions& options, std::optional<ScenePart> part);
  // The same scene with other Gaussians, which are those of the file `splat`; empty: of none.
  std::unique_ptr<OpenScene> WithModel(GaussianModel model,
                                       const std::filesystem::path& splat) const;
  // The file whose splat it is from now on.
  void SetSplat(const std::filesystem::path& splat, std::shared_future<FileChecksum> checksum);

  const Workspace& workspace() const { return *workspace_; }
  const Reconstruction& reconstruction() const { return workspace_->reconstruction; }
  const GaussianModel& original() const { return model_; }
  // Of the splat, of which original() may be a part.
  size_t NumGaussians() const;
  const std::optional<ScenePart>& part() const { return part_; }
  const SessionOptions& options() const { return options_; }
  // Of the file whose splat it is; empty and invalid for a scene made from memory.
  const std::filesystem::path& splat_path() const { return splat_path_; }
  const std::shared_future<FileChecksum>& splat_checksum() const { return splat_checksum_; }
  Renderer& renderer() { return *renderer_; }
  const Backend& backend() const { return *backend_; }
  // Another renderer of the same scene, with a backend of its own (on a GPU: streams of its own).
  // In host memory it shares the geometries of views with renderer(), which get less room while a
  // fit with it keeps weights. Any thread may call this.
  std::unique_ptr<Renderer> MakeRenderer() const;
  // Of a splat alone: the views that were placed around it; else null.
  const std::shared_ptr<const Reconstruction>& placed_views() const { return placed_views_; }
  // The pictures that the user sees and names, in the pixels of options().pixels.
  Pictures pictures() const { return Pictures(workspace(), options_.pixels); }
  StageClock& clock() { return clock_; }
  const StageClock& clock() const { return clock_; }
  // By name. Views that a part does not show are in none of the three.
  const std::vector<const View*>& views() const { return views_; }
  const std::vector<const View*>& train_views() const { return train_; }
  const std::vector<const View*>& heldout_views() const { return heldout_; }

  // One view with the coefficients `sh`, [N, K, 3]. Not clamped.
  Image Render(const View& view, std::span<const float> sh);
  // The view's photo. Without a photo, and outside the reach of an undistorted one, it is the
  // original's render, so that nothing has to change there.
  Image Picture(const View& view);
  // The splat with the coefficients `sh`, atomically; all else of the source file is unchanged. Of
  // a part it is a copy of the file, in which the records that changed are patched.
  void WriteSplat(const std::filesystem::path& path, FloatArray sh, Monitor& monitor) const;

 private:
  OpenScene(std::shared_ptr<const Workspace> workspace, GaussianModel model,
            const SessionOptions& options, std::optional<ScenePart> part,
            std::shared_ptr<Backend> backend);
  void SplitViews();
  void WritePatched(const std::filesystem::path& path, std::span<const float> sh,
                    Monitor& monitor) const;
  RendererOptions RenderOptions() const;

  std::shared_ptr<const Workspace> workspace_;
  GaussianModel model_;
  SessionOptions options_;
  std::optional<ScenePart> part_;
  InputGuard inputs_;
  std::filesystem::path splat_path_;
  std::shared_future<FileChecksum> splat_checksum_;
  std::shared_ptr<const Reconstruction> placed_views_;
  StageClock clock_;
  std::shared_ptr<Backend> backend_;
  std::shared_ptr<GeometryCache> cache_;
  std::unique_ptr<Renderer> renderer_;
  std::vector<const View*> views_, train_, heldout_;
};

}  // namespace retint
