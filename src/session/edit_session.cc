// SPDX-License-Identifier: BSD-3-Clause
#include "session/edit_session.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "base/error.h"
#include "colmap_io/image_io.h"
#include "session/main_colors.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

std::string SizeText(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

bool AnySet(const Mask& mask) {
  return std::any_of(mask.data.begin(), mask.data.end(), [](uint8_t value) { return value > 0; });
}

std::shared_ptr<Backend> OpenBackend(const std::string& name) {
  try {
    return CreateBackend(name);
  } catch (const std::invalid_argument& error) {
    throw OptionError(std::string("--backend: ") + error.what());
  }
}

}  // namespace

void SessionOptions::Check() const {
  CheckOption(holdout == 0 || holdout >= 2, "--holdout must be 0 (none) or at least 2");
  CheckOption(backend == "auto" || backend == "cpu" || backend == "cuda",
              "--backend: '" + backend + "' is not auto, cpu or cuda");
}

std::unique_ptr<EditSession> EditSession::Open(const std::filesystem::path& workspace,
                                               const std::filesystem::path& splat,
                                               const SessionOptions& options, Monitor& monitor) {
  options.Check();
  StageClock clock;
  std::unique_ptr<EditSession> session;
  // Beside the reading, of the same cached pages; what is saved later refers to these bytes.
  std::shared_future<FileChecksum> checksum =
      std::async(std::launch::async, [splat] { return ChecksumFile(splat); });
  {
    const StageClock::Lap lap(clock, "load");
    monitor.Step("load", 0, 1);
    Workspace opened = Workspace::Open(workspace, options.image_folder);
    opened.RequirePinhole();
    GaussianModel model = ReadSplat(splat, monitor);
    monitor.ThrowIfCancelled();
    session = std::make_unique<EditSession>(std::move(opened), std::move(model), options);
    monitor.Step("load", 1, 1);
  }
  session->clock_ = clock;
  session->splat_path_ = std::filesystem::absolute(splat).lexically_normal();
  session->splat_checksum_ = std::move(checksum);
  return session;
}

EditSession::EditSession(Workspace workspace, GaussianModel model, const SessionOptions& options)
    : workspace_(std::move(workspace)),
      model_(std::move(model)),
      options_(options),
      backend_(OpenBackend(options.backend)),
      history_(options.history_bytes) {
  options_.Check();
  RendererOptions render;
  render.cache_bytes = options_.cache_bytes;
  render.background = options_.background;
  renderer_ = std::make_unique<Renderer>(backend_, model_, render);
  SplitViews();
}

EditSession::~EditSession() = default;

void EditSession::SplitViews() {
  const std::vector<const View*> views = reconstruction().ViewsByName();
  for (size_t i = 0; i < views.size(); ++i) {
    const bool out = options_.holdout > 0 && i % static_cast<size_t>(options_.holdout) == 0;
    (out ? heldout_ : train_).push_back(views[i]);
  }
  if (train_.empty()) {
    throw InputError(workspace_.sparse_folder, "--holdout " + std::to_string(options_.holdout) +
                                                   " leaves no view of " +
                                                   std::to_string(views.size()) + " to fit");
  }
}

PaintedView EditSession::Paint(std::string_view view_name, Mask mask) const {
  const View& view = workspace_.RequireView(view_name);
  PaintedView painted{view.name, reconstruction().Posed(view), std::move(mask)};
  const Camera& camera = painted.camera.camera;
  if (painted.mask.width != camera.width || painted.mask.height != camera.height) {
    throw InputError("mask of view " + view.name + " is " +
                     SizeText(painted.mask.width, painted.mask.height) + ", the view is " +
                     SizeText(camera.width, camera.height));
  }
  if (!AnySet(painted.mask)) {
    throw InputError("mask of view " + view.name + ": no pixel is selected");
  }
  return painted;
}

void EditSession::CheckMasks(const std::map<std::string, Mask>& masks) const {
  bool any = false;
  for (const auto& [name, mask] : masks) {
    const Camera& camera = reconstruction().Posed(workspace_.RequireView(name)).camera;
    if (mask.width != camera.width || mask.height != camera.height) {
      throw InputError("mask of view " + name + " is " + SizeText(mask.width, mask.height) +
                       ", the view is " + SizeText(camera.width, camera.height));
    }
    any = any || AnySet(mask);
  }
  if (!any) throw InputError("no view's mask has a selected pixel");
}

std::shared_ptr<RegionSelection> EditSession::MakeSelection(const std::string& name,
                                                            std::map<std::string, Mask> masks,
                                                            std::vector<float> shares,
                                                            SelectionSource source,
                                                            Monitor& monitor) {
  CheckMasks(masks);
  auto selection = std::make_shared<RegionSelection>();
  selection->id = next_selection_++;
  selection->masks = std::move(masks);
  selection->source = std::move(source);
  if (shares.empty()) {
    shares =
        MaskShares(*renderer_, Targets(selection->masks, train_, TargetKind::kRender), monitor);
  }
  if (shares.size() != model_.NumGaussians()) {
    throw InputError("shares of region " + name + ": " + std::to_string(shares.size()) +
                     " values for " + std::to_string(model_.NumGaussians()) + " Gaussians");
  }
  selection->shares = std::move(shares);
  return selection;
}

RegionId EditSession::AddRegion(std::string name, std::map<std::string, Mask> masks,
                                std::vector<float> shares, const ColorEdit& edit, Monitor& monitor,
                                SelectionSource source) {
  edit.Check();
  auto selection =
      MakeSelection(name, std::move(masks), std::move(shares), std::move(source), monitor);
  RegionSet state = regions();
  Region region;
  region.id = next_region_++;
  region.name = std::move(name);
  region.selection = std::move(selection);
  region.edit = WithMainColors(edit, *region.selection, reconstruction(), *renderer_, CurrentSh());
  state.regions.push_back(region);
  history_.Push("Add " + region.name, std::move(state));
  return region.id;
}

namespace {

Region& Require(RegionSet& state, RegionId id) {
  Region* region = state.Find(id);
  if (!region) throw OptionError("there is no region " + std::to_string(id));
  return *region;
}

}  // namespace

void EditSession::SetSelection(RegionId id, std::map<std::string, Mask> masks,
                               std::vector<float> shares, Monitor& monitor,
                               SelectionSource source) {
  RegionSet state = regions();
  Region& region = Require(state, id);
  region.selection =
      MakeSelection(region.name, std::move(masks), std::move(shares), std::move(source), monitor);
  history_.Push("Select " + region.name, std::move(state));
}

RegionId EditSession::DuplicateRegion(RegionId id) {
  RegionSet state = regions();
  Region copy = Require(state, id);
  const std::string label = "Duplicate " + copy.name;
  copy.id = next_region_++;
  copy.name += " copy";
  copy.fit = nullptr;  // it starts from what the first left, so its fit is another
  const auto at = std::find_if(state.regions.begin(), state.regions.end(),
                               [&](const Region& region) { return region.id == id; });
  const RegionId copied = copy.id;
  state.regions.insert(at + 1, std::move(copy));
  history_.Push(label, std::move(state));
  return copied;
}

void EditSession::CheckRegion(const Region& region) const {
  const std::string name = "region " + region.name + ": ";
  if (region.id == 0 || !region.selection || region.selection->id == 0) {
    throw InputError(name + "has no id or no selection");
  }
  CheckMasks(region.selection->masks);
  if (region.selection->shares.size() != model_.NumGaussians()) {
    throw InputError(name + std::to_string(region.selection->shares.size()) + " shares for " +
                     std::to_string(model_.NumGaussians()) + " Gaussians");
  }
  if (!(region.strength >= 0 && region.strength <= 1)) {
    throw InputError(name + "strength is not between 0 and 1");
  }
  try {
    region.edit.Check();
    CheckOption(!region.edit.NeedsMainColor(), "recolor: the main color is missing");
  } catch (const OptionError& error) {
    throw InputError(name + error.what());
  }
  if (!region.fit) return;
  const RegionFit& fit = *region.fit;
  const size_t block = static_cast<size_t>(model_.NumShCoeffs()) * 3;
  const auto count = static_cast<int64_t>(model_.NumGaussians());
  const bool ascending =
      std::is_sorted(fit.indices.begin(), fit.indices.end(), std::less_equal<>());
  if (fit.sh.size() != fit.indices.size() * block || !ascending ||
      (!fit.indices.empty() && (fit.indices.front() < 0 || fit.indices.back() >= count))) {
    throw InputError(name + "its fit is of another scene");
  }
}

void EditSession::RestoreRegions(RegionSet restored, const RefitJob& job) {
  try {
    job.Check();
  } catch (const OptionError& error) {
    throw InputError(std::string("refit options: ") + error.what());
  }
  RegionId next_region = next_region_;
  uint64_t next_selection = next_selection_;
  for (size_t i = 0; i < restored.regions.size(); ++i) {
    const Region& region = restored.regions[i];
    CheckRegion(region);
    if (restored.Find(region.id) != &region) {
      throw InputError("region " + region.name + ": its id comes twice");
    }
    next_region = std::max(next_region, region.id + 1);
    next_selection = std::max(next_selection, region.selection->id + 1);
  }
  history_.Restart(std::move(restored));
  last_job_ = job;
  next_region_ = next_region;
  next_selection_ = next_selection;
}

void EditSession::SetEdit(RegionId id, const ColorEdit& edit, float strength,
                          std::string_view merge_key) {
  edit.Check();
  CheckOption(strength >= 0 && strength <= 1, "strength must be between 0 and 1");
  RegionSet state = regions();
  Region& region = Require(state, id);
  region.edit = edit;
  if (edit.NeedsMainColor()) {
    GaussianModel scratch;
    const auto index = static_cast<size_t>(&region - state.regions.data());
    region.edit =
        WithMainColors(edit, *region.selection, reconstruction(), *renderer_,
                       ComposeSh(state, last_job_, 0, index, model_.sh, model_.NumShCoeffs()));
  }
  region.strength = strength;
  history_.Push("Recolor " + region.name, std::move(state), merge_key);
}

void EditSession::SetVisible(RegionId id, bool visible) {
  RegionSet state = regions();
  Region& region = Require(state, id);
  if (region.visible == visible) return;
  region.visible = visible;
  history_.Push((visible ? "Show " : "Hide ") + region.name, std::move(state));
}

void EditSession::Rename(RegionId id, std::string name) {
  RegionSet state = regions();
  Require(state, id).name = name;
  history_.Push("Rename " + name, std::move(state));
}

void EditSession::MoveRegion(RegionId id, size_t position) {
  RegionSet state = regions();
  const Region region = Require(state, id);
  std::erase_if(state.regions, [&](const Region& other) { return other.id == id; });
  const size_t at = std::min(position, state.regions.size());
  state.regions.insert(state.regions.begin() + static_cast<std::ptrdiff_t>(at), region);
  history_.Push("Move " + region.name, std::move(state));
}

void EditSession::RemoveRegion(RegionId id) {
  RegionSet state = regions();
  const std::string name = Require(state, id).name;
  std::erase_if(state.regions, [&](const Region& region) { return region.id == id; });
  history_.Push("Remove " + name, std::move(state));
}

std::vector<RefitTarget> EditSession::Targets(const std::map<std::string, Mask>& masks,
                                              const std::vector<const View*>& views,
                                              TargetKind target) const {
  std::vector<RefitTarget> targets;
  for (const View* view : views) {
    const auto mask = masks.find(view->name);
    if (mask == masks.end()) continue;
    const auto photo = photos_.find(view->name);
    const bool use_photo = target == TargetKind::kPhoto && photo != photos_.end();
    targets.push_back({view->name, reconstruction().Posed(*view), &mask->second,
                       use_photo ? &photo->second : nullptr});
  }
  return targets;
}

void EditSession::LoadPhotos(Monitor& monitor) {
  if (!photos_.empty()) return;
  std::map<std::string, Image> photos;
  const auto views = reconstruction().ViewsByName();
  for (size_t i = 0; i < views.size(); ++i) {
    monitor.Step("load", static_cast<double>(i), static_cast<double>(views.size()));
    photos.emplace(views[i]->name, workspace_.ReadPhoto(*views[i]));
  }
  photos_ = std::move(photos);
}

RefitChainInput EditSession::ChainInput(const RefitJob& job, Monitor& monitor) {
  job.Check();
  if (job.target == TargetKind::kPhoto) LoadPhotos(monitor);
  RefitChainInput input;
  input.original = &model_;
  input.state = regions();
  input.job = job;
  for (const Region& region : input.state.regions) {
    input.targets.push_back(Targets(region.selection->masks, train_, job.target));
  }
  return input;
}

void EditSession::Refit(const RefitJob& job, Monitor& monitor) {
  const StageClock::Lap lap(clock_, "refit");
  RefitChain chain(ChainInput(job, monitor), *renderer_);
  while (chain.Step(monitor)) {
  }
  last_job_ = job;
  for (const auto& [id, fit] : chain.fits()) history_.SetFit(id, fit);
}

BackgroundOptimizer& EditSession::optimizer() {
  if (!optimizer_) optimizer_ = std::make_unique<BackgroundOptimizer>();
  return *optimizer_;
}

uint64_t EditSession::StartRefit(const RefitJob& job, Monitor& monitor) {
  const std::string backend_name(backend_->Name());
  RendererOptions render;
  render.cache_bytes = options_.cache_bytes;
  render.background = options_.background;
  if (!background_renderer_) background_renderer_ = std::make_shared<std::unique_ptr<Renderer>>();
  auto input = std::make_shared<RefitChainInput>(ChainInput(job, monitor));
  last_job_ = job;
  return optimizer().Start([input, backend_name, render, renderer = background_renderer_](
                               Monitor&) -> std::unique_ptr<OptimizerJob> {
    // A backend of its own: on a GPU, streams of its own.
    if (!*renderer) {
      *renderer = std::make_unique<Renderer>(OpenBackend(backend_name), *input->original, render);
    }
    return std::make_unique<RefitChain>(*input, **renderer);
  });
}

void EditSession::DropFits() {
  optimizer().Cancel();
  optimizer().Wait();
  optimizer().Forget();
  const RegionSet state = regions();
  for (const Region& region : state.regions) history_.SetFit(region.id, nullptr);
}

bool EditSession::CollectFits() {
  const auto newest = optimizer().Newest();
  if (!newest) return false;
  bool any = false;
  const RegionSet& state = regions();
  for (size_t i = 0; i < state.regions.size(); ++i) {
    const Region& region = state.regions[i];
    const auto found = newest->fits.find(region.id);
    if (found == newest->fits.end() || found->second == region.fit) continue;
    if (found->second->key != state.FitKey(i, last_job_)) continue;
    history_.SetFit(region.id, found->second);
    any = true;
  }
  return any;
}

std::vector<float> EditSession::CurrentSh() const {
  return ComposeSh(regions(), last_job_, 0, regions().regions.size(), model_.sh,
                   model_.NumShCoeffs());
}

RefitSummary EditSession::Summary() const {
  RefitSummary sum;
  bool first = true;
  for (const Region& region : regions().regions) {
    if (!region.visible || !region.fit) continue;
    const RefitSummary& one = region.fit->summary;
    if (first) {
      sum = one;
    } else {
      sum.iterations += one.iterations;
      sum.active_gaussians += one.active_gaussians;
      sum.changed_gaussians += one.changed_gaussians;
      sum.converged = sum.converged && one.converged;
      sum.losses.insert(sum.losses.end(), one.losses.begin(), one.losses.end());
    }
    first = false;
  }
  return sum;
}

QualityReport EditSession::Evaluate(RegionId id, std::span<const float> sh_before,
                                    std::span<const float> sh_after, TargetKind target,
                                    Monitor& monitor, size_t most_views) {
  const Region* region = regions().Find(id);
  if (!region) throw OptionError("there is no region " + std::to_string(id));
  if (target == TargetKind::kPhoto) LoadPhotos(monitor);
  const auto targets = [&](const std::vector<const View*>& views) {
    std::vector<RefitTarget> all = Targets(region->selection->masks, views, target);
    if (most_views == 0 || all.size() <= most_views) return all;
    std::vector<RefitTarget> some;
    for (size_t i = 0; i < most_views; ++i) some.push_back(all[i * all.size() / most_views]);
    return some;
  };
  return EvaluateEdit(*renderer_, sh_before, sh_after, targets(train_), targets(heldout_),
                      region->EffectiveEdit(), monitor);
}

Image EditSession::RenderView(const View& view, std::span<const float> sh) {
  renderer_->SetSh(sh);
  return std::move(renderer_->Render(reconstruction().Posed(view)).rgb);
}

Image EditSession::EditedTarget(const View& view, TargetKind target) {
  Image image =
      target == TargetKind::kPhoto ? workspace_.ReadPhoto(view) : RenderView(view, model_.sh);
  for (const Region& region : regions().regions) {
    const auto found = region.selection->masks.find(view.name);
    if (!region.visible || found == region.selection->masks.end()) continue;
    const CompiledEdit edit(region.EffectiveEdit());
    for (size_t i = 0; i < image.NumPixels(); ++i) {
      if (found->second.data[i] == 0) continue;
      const Eigen::Map<Eigen::Vector3f> pixel(image.data.data() + 3 * i);
      Eigen::Map<Eigen::Vector3f>(image.data.data() + 3 * i) =
          edit.Apply(pixel, static_cast<float>(found->second.data[i]) / 255.0F);
    }
  }
  return image;
}

void EditSession::WriteSplat(const std::filesystem::path& path, Monitor& monitor) const {
  GaussianModel edited = model_;
  edited.sh = CurrentSh();
  retint::WriteSplat(path, edited, monitor);
}

void EditSession::WriteMasks(const std::filesystem::path& folder, RegionId id,
                             Monitor& monitor) const {
  const Region* region = regions().Find(id);
  if (!region) throw OptionError("there is no region " + std::to_string(id));
  const auto& masks = region->selection->masks;
  size_t written = 0;
  for (const auto& [name, mask] : masks) {
    monitor.Step("save", static_cast<double>(written++), static_cast<double>(masks.size()));
    WritePng(ViewFile(folder, name), mask);
  }
}

RunReport EditSession::MakeReport() const {
  RunReport report;
  report.backend = backend_->Name();
  report.gaussians = static_cast<int64_t>(model_.NumGaussians());
  report.views = static_cast<int>(reconstruction().views.size());
  for (const char* stage :
       {"load", "depth", "cloud", "registration", "projection", "refit", "save"}) {
    report.stages_ms[stage] = clock_.Get(stage);
  }
  report.stages_ms["total"] = clock_.Total();
  report.peak_rss_mb = PeakRssMb();
  report.peak_device_mb = static_cast<double>(backend_->PeakDeviceBytes()) / (1024.0 * 1024.0);
  report.refit = Summary();
  if (regions().regions.size() == 1) report.edit = regions().regions.front().EffectiveEdit();
  return report;
}

}  // namespace retint
