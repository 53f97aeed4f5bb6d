// SPDX-License-Identifier: BSD-3-Clause
#include "opening/open_scene.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <stdexcept>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/option_name.h"
#include "base/ranks.h"
#include "opening/ocio_space.h"
#include "opening/render_model.h"
#include "opening/virtual_views.h"
#include "scene/sh_band4.h"
#include "splat_io/splat_checksum.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

Workspace PlacedViews(const GaussianModel& model, const SessionOptions& options, Monitor& monitor) {
  if (!options.view_folder.empty()) return ReadPlacedViews(options.view_folder);
  VirtualViewOptions views;
  views.views = options.views;
  return PlaceViewsOnce(OpenBackend(options.backend), model, views, CacheFolder(), monitor);
}

// Beside the reading, of the same cached pages; sessions saved later refer to these bytes.
std::shared_future<FileChecksum> StartChecksum(const fs::path& splat) {
  return std::async(std::launch::async, [splat] { return ChecksumSplat(splat); });
}

}  // namespace

std::shared_ptr<Backend> OpenBackend(const std::string& name) {
  try {
    return CreateBackend(name);
  } catch (const std::invalid_argument& error) {
    throw OptionError(OptionName("backend") + ": " + error.what());
  }
}

Workspace OpenWorkspace(const fs::path& folder, const SessionOptions& options) {
  Workspace workspace = Workspace::Open(folder, options.image_folder, options.model);
  workspace.UndistortViews();
  workspace.Transform(options.world_from_splat.Inverse());
  return workspace;
}

void SessionOptions::Check() const {
  CheckOption(holdout == 0 || holdout >= 2,
              OptionName("holdout") + " must be 0 (none) or at least 2");
  CheckOption(backend == "auto" || backend == "cpu" || backend == "cuda",
              OptionName("backend") + ": '" + backend + "' is not auto, cpu or cuda");
  CheckOption(
      !render_model || *render_model == RenderModel::kDefault || *render_model == RenderModel::kMip,
      OptionName("render_model") + " is default or mip");
  VirtualViewOptions placed;
  placed.views = views;
  placed.Check();
}

std::unique_ptr<OpenScene> OpenScene::Open(const fs::path& workspace, const fs::path& splat,
                                           const SessionOptions& options, Monitor& monitor) {
  options.Check();
  StageClock clock;
  std::unique_ptr<OpenScene> scene;
  std::shared_future<FileChecksum> checksum = StartChecksum(splat);
  {
    const StageClock::Lap lap(clock, "load");
    monitor.Step("load", 0, 1);
    Workspace opened;
    if (!workspace.empty()) opened = OpenWorkspace(workspace, options);
    GaussianModel model = ReadSplat(splat, monitor);
    ChooseRenderModel(options.render_model, splat, workspace, model);
    ChooseSpace(options.space, model);
    monitor.ThrowIfCancelled();
    if (workspace.empty()) opened = PlacedViews(model, options, monitor);
    scene = std::make_unique<OpenScene>(std::move(opened), std::move(model), options);
    monitor.Step("load", 1, 1);
  }
  scene->clock_ = clock;
  scene->options_.view_folder.clear();  // the views are kept, not where they came from
  scene->SetSplat(splat, std::move(checksum));
  scene->inputs_.AddSplat(splat, SplatFiles(splat));
  return scene;
}

OpenScene::OpenScene(Workspace workspace, GaussianModel model, const SessionOptions& options)
    : OpenScene(std::make_shared<const Workspace>(std::move(workspace)), std::move(model), options,
                std::nullopt) {}

OpenScene::OpenScene(std::shared_ptr<const Workspace> workspace, GaussianModel model,
                     const SessionOptions& options, std::optional<ScenePart> part)
    : OpenScene(std::move(workspace), std::move(model), options, part,
                part ? part->backend : nullptr) {}

OpenScene::OpenScene(std::shared_ptr<const Workspace> workspace, GaussianModel model,
                     const SessionOptions& options, std::optional<ScenePart> part,
                     std::shared_ptr<Backend> backend)
    : workspace_(std::move(workspace)),
      model_(std::move(model)),
      options_(options),
      part_(std::move(part)),
      backend_(backend ? std::move(backend) : OpenBackend(options.backend)) {
  options_.Check();
  ChooseRenderModel(options_.render_model, part_ ? part_->file->path() : fs::path(),
                    workspace_->root, model_);
  if (!model_.traits.chosen_space) ChooseSpace(options_.space, model_);
  cache_ = std::make_shared<GeometryCache>(options_.cache_bytes);
  renderer_ = std::make_unique<Renderer>(backend_, model_, RenderOptions(), cache_);
  SplitViews();
  if (part_) {
    splat_path_ = fs::absolute(part_->file->path()).lexically_normal();
  } else {
    for (const fs::path& file : workspace_->Files()) inputs_.Add(file);
  }
  if (workspace_->has_virtual_views) {
    placed_views_ = std::make_shared<const Reconstruction>(reconstruction());
  }
}

std::unique_ptr<OpenScene> OpenScene::WithModel(GaussianModel model, const fs::path& splat) const {
  std::unique_ptr<OpenScene> scene(
      new OpenScene(workspace_, std::move(model), options_, std::nullopt, backend_));
  scene->clock_ = clock_;
  if (!splat.empty()) scene->SetSplat(splat, StartChecksum(splat));
  return scene;
}

void OpenScene::SetSplat(const fs::path& splat, std::shared_future<FileChecksum> checksum) {
  splat_path_ = fs::absolute(splat).lexically_normal();
  splat_checksum_ = std::move(checksum);
}

RendererOptions OpenScene::RenderOptions() const {
  RendererOptions options;
  options.cache_bytes = options_.cache_bytes;
  options.background = options_.background;
  return options;
}

std::unique_ptr<Renderer> OpenScene::MakeRenderer() const {
  RendererOptions options = RenderOptions();
  options.makes_room = backend_->IsHost();
  return std::make_unique<Renderer>(OpenBackend(std::string(backend_->Name())), model_, options,
                                    backend_->IsHost() ? cache_ : nullptr);
}

void OpenScene::SplitViews() {
  const std::vector<const View*> views = reconstruction().ViewsByName();
  std::map<std::string, bool> out;  // by photo: its faces stay together
  for (const View* view : views) out.emplace(workspace_->PhotoName(*view), false);
  size_t i = 0;
  for (auto& [name, is_out] : out) {
    is_out = options_.holdout > 0 && i++ % static_cast<size_t>(options_.holdout) == 0;
  }
  for (const View* view : views) {
    if (part_ && !part_->views.contains(view->id)) continue;
    views_.push_back(view);
    (out.at(workspace_->PhotoName(*view)) ? heldout_ : train_).push_back(view);
  }
  if (train_.empty() && !part_) {  // a part may be of a view that is held out
    throw InputError(workspace_->sparse_folder,
                     OptionName("holdout", std::to_string(options_.holdout)) +
                         " leaves no view of " + std::to_string(views.size()) + " to fit");
  }
}

Image OpenScene::Render(const View& view, std::span<const float> sh) {
  renderer_->SetSh(sh);
  return std::move(renderer_->Render(reconstruction().Posed(view)).rgb);
}

Image OpenScene::Picture(const View& view) {
  if (!workspace_->HasPhoto(view)) return Render(view, model_.sh);
  Image photo = workspace_->ReadPhoto(view);
  if (!workspace_->PhotoOf(view)) return photo;
  const Mask reach = workspace_->photo_pixels->Reach(view.id);
  const Image render = Render(view, model_.sh);
  for (size_t i = 0; i < reach.data.size(); ++i) {
    if (reach.data[i] == 0) std::copy_n(&render.data[3 * i], 3, &photo.data[3 * i]);
  }
  return photo;
}

size_t OpenScene::NumGaussians() const {
  return part_ ? static_cast<size_t>(part_->file->count()) : model_.NumGaussians();
}

void OpenScene::WritePatched(const fs::path& path, std::span<const float> sh,
                             Monitor& monitor) const {
  const size_t block = static_cast<size_t>(model_.NumShCoeffs()) * 3;
  std::vector<uint32_t> records;
  std::vector<float> changed;
  for (size_t g = 0; g < model_.NumGaussians(); ++g) {
    const float* const now = sh.data() + g * block;
    if (std::memcmp(now, model_.sh.data() + g * block, block * sizeof(float)) == 0) continue;
    records.push_back(part_->records[g]);
    changed.insert(changed.end(), now, now + block);
  }
  InputGuard replaced;
  replaced.AllowSplat(path);
  part_->file->WritePatched(path, records, changed, monitor);
}

void OpenScene::WriteSplat(const fs::path& path, FloatArray sh, Monitor& monitor) const {
  if (part_) return WritePatched(path, sh, monitor);
  GaussianModel edited = model_;
  edited.sh = std::move(sh);
  // Degree 4 was not there when the new colors were fitted.
  ShBand4Columns band4(edited);
  const size_t block = static_cast<size_t>(model_.NumShCoeffs()) * 3;
  for (size_t g = 0; band4.present() && g < model_.NumGaussians(); ++g) {
    const float* const now = edited.sh.data() + g * block;
    if (!std::equal(now, now + block, model_.sh.data() + g * block)) band4.Set(g, {});
  }
  retint::WriteSplat(path, edited, monitor);
}

}  // namespace retint
