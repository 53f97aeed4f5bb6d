// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/large_scene.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/memory.h"
#include "base/option_name.h"
#include "depth/factory.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr double kMiB = 1024.0 * 1024.0;
// A selection's box is that of its points and a little more, for Gaussians reach beyond them.
constexpr float kBoxMargin = 0.1F;

// Added to the limit that a message calls enough: the program's own size differs from run to run.
constexpr size_t kSlack = size_t{8} << 20;

// Of a session of a whole splat, beside its Gaussians.
constexpr size_t kWholeBytes = size_t{136} << 20;

// Of a build of an index: the memory in use already, and that of threads and the allocator.
size_t BesideIndex() {
  constexpr size_t kThreads = size_t{24} << 20;
  return ResidentBytes() + kThreads;
}

size_t RoomForIndex(const MemoryLimits& limits) {
  const size_t beside = BesideIndex(), limit = limits.HostBytes();
  return limit > beside ? limit - beside : 0;
}

// Rounded up.
size_t Mebibytes(size_t bytes) { return (bytes + (size_t{1} << 20) - 1) >> 20; }

Frustum FrustumOf(const PosedCamera& camera) { return Frustum(ToCameraParams(camera)); }

Eigen::AlignedBox3f BoxOf(const SelectionCloud& cloud) {
  Eigen::AlignedBox3f box;
  for (const SelectionPoint& point : cloud.points) box.extend(point.position);
  const Eigen::Vector3f margin =
      Eigen::Vector3f::Constant(kBoxMargin * box.diagonal().norm() + 1e-6F);
  return {box.min() - margin, box.max() + margin};
}

std::vector<const View*> LeastFirst(std::vector<std::pair<double, const View*>> views) {
  std::stable_sort(views.begin(), views.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<const View*> sorted;
  for (const auto& [key, view] : views) sorted.push_back(view);
  return sorted;
}

}  // namespace

bool IsTooLarge(const fs::path& splat, const MemoryLimits& limits, size_t cache_bytes) {
  try {
    const PlyFile file(splat);
    EditSize size;
    size.gaussians = size.most_visible = file.count();
    size.active = 1;  // the memory of a report counts
    size.on_device = limits.CacheSide() == MemorySide::kDevice;
    size.is_whole = true;
    MemoryBytes bytes{kWholeBytes + HostBytesOf(size), DeviceBytesOf(size)};
    if (size.on_device) bytes.host += ResidentBytes();  // its driver is in memory already
    bytes.On(limits.CacheSide()) += cache_bytes;
    return !limits.Hold(bytes);
  } catch (const InputError&) {
    return false;
  }
}

SplatIndex OpenIndex(const PlyFile& splat, const fs::path& path, const MemoryLimits& limits,
                     SplatIndexOptions options, bool force, Monitor& monitor, std::string* built) {
  options.memory_bytes = RoomForIndex(limits);
  try {
    if (force) SplatIndex::Build(splat, path, options, monitor);
    return SplatIndex::OpenOrBuild(splat, path, options, monitor, built);
  } catch (const IndexMemoryError& error) {
    throw OptionError(OptionName("memory_mb", std::to_string(limits.HostBytes() >> 20)) +
                      " is too little to index " + std::to_string(splat.count()) + " Gaussians; " +
                      OptionName("memory_mb", std::to_string(Mebibytes(BesideIndex() + kSlack +
                                                                       error.least_bytes()))) +
                      " is enough");
  }
}

LargeScene::LargeScene(const fs::path& workspace, const fs::path& splat,
                       const SessionOptions& options, const LargeSceneOptions& large,
                       Monitor& monitor)
    : options_(options), large_(large) {
  options_.Check();
  CheckOption(!workspace.empty(),
              "a splat that is opened in parts needs a workspace: views are placed around a whole "
              "one");
  const StageClock::Lap lap(clock_, "load");
  file_ = std::make_shared<const PlyFile>(splat);
  workspace_ = std::make_shared<const Workspace>(OpenWorkspace(workspace, options));
  for (const fs::path& file : workspace_->Files()) inputs_.Add(file);
  inputs_.AddSplat(splat, {splat});
  backend_ = OpenBackend(options.backend);
  large_.limits = large_.limits.For(*backend_);
  {
    StageClock index;
    const fs::path path = large_.index.empty() ? SplatIndex::PathFor(splat) : large_.index;
    SplatIndexOptions build;
    // The least in any case: a limit below that is refused soon, with the memory of the whole edit.
    build.memory_bytes = std::max(std::min(build.memory_bytes, RoomForIndex(large_.limits)),
                                  SplatIndex::LeastBytes(*file_, build));
    index_ = std::make_unique<SplatIndex>(
        SplatIndex::OpenOrBuild(*file_, path, build, monitor, &index_built_));
    if (!index_built_.empty()) report_.index_ms = index.Total();
  }
  ReleaseFreedMemory();
  base_bytes_ = ResidentBytes();
  report_.all_blocks = static_cast<int64_t>(index_->blocks().size());
  report_.memory_limit_mb = static_cast<double>(large_.limits.host_bytes) / kMiB;
  report_.device_limit_mb = static_cast<double>(large_.limits.device_bytes) / kMiB;
}

bool LargeScene::WriteIndexOf(const fs::path& copy, const fs::path& target) const {
  if (!SplatIndex::IsReplaceable(SplatIndex::PathFor(target))) return false;
  index_->WriteFor(PlyFile(copy), SplatIndex::PathFor(copy));
  return true;
}

std::vector<const View*> LargeScene::FacesOf(const std::vector<std::string>& names) const {
  const Pictures all = pictures();
  std::vector<const View*> faces;
  for (const std::string& name : names) {
    for (const UserPicture* picture : all.Require(name)) {
      faces.insert(faces.end(), picture->faces.begin(), picture->faces.end());
    }
  }
  return faces;
}

std::vector<uint32_t> LargeScene::BlocksOf(const Need& need) const {
  if (need.everything) {
    std::vector<uint32_t> all(index_->blocks().size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<uint32_t>(i);
    return all;
  }
  std::vector<Frustum> frusta;
  for (const View* view : need.views) {
    frusta.push_back(FrustumOf(workspace_->reconstruction.Posed(*view)));
  }
  for (const PosedCamera& camera : need.cameras) frusta.push_back(FrustumOf(camera));
  return index_->Visible(frusta, need.within);
}

uint64_t LargeScene::VisibleTo(const PosedCamera& camera) const {
  const CameraParams params = ToCameraParams(camera);
  const std::string key(reinterpret_cast<const char*>(&params), sizeof(params));
  const auto found = visible_.find(key);
  if (found != visible_.end()) return found->second;
  const Frustum frustum(params);
  return visible_[key] = index_->CountOf(index_->Visible(std::span(&frustum, 1)));
}

EditSize LargeScene::SizeOf(const Need& need) const {
  EditSize size;
  size.gaussians = index_->CountOf(BlocksOf(need));
  size.on_device = !backend_->IsHost();
  if (large_.refit) {
    size.active = need.active;
    size.refit = *large_.refit;
  }
  const auto add = [&](const PosedCamera& posed) {
    const Camera& camera = posed.camera;
    const auto pixels = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
    size.pixels += pixels;
    size.largest_pixels = std::max(size.largest_pixels, pixels);
    size.most_visible = std::max(size.most_visible, VisibleTo(posed));
    ++size.views;
  };
  for (const View* view : need.views) add(workspace_->reconstruction.Posed(*view));
  for (const PosedCamera& camera : need.cameras) add(camera);
  if (need.completes) {
    size.graph_nodes =
        need.everything ? file_->count() : index_->CountOf(index_->Visible({}, need.within));
  }
  return size;
}

size_t LargeScene::ViewsThatFit(Need need, const std::vector<const View*>& largest_first) const {
  const std::vector<const View*> always = need.views;
  size_t low = 0, high = largest_first.size();
  while (low < high) {
    const size_t middle = (low + high + 1) / 2;
    need.views = always;
    need.views.insert(need.views.end(), largest_first.begin(),
                      largest_first.begin() + static_cast<std::ptrdiff_t>(middle));
    const bool fits = large_.limits.Hold(BytesFor(SizeOf(need)));
    (fits ? low : high) = fits ? middle : middle - 1;
  }
  return low;
}

LargeScene::Need LargeScene::EditOf(const Need& shown) const {
  Need edit = shown;
  std::vector<Frustum> frusta;
  for (const View* view : shown.views) {
    const PosedCamera posed = workspace_->reconstruction.Posed(*view);
    frusta.push_back(FrustumOf(posed));
    edit.active += VisibleTo(posed);
  }
  Eigen::AlignedBox3f box;
  for (const IndexBlock& block : index_->blocks()) {
    GaussianBounds middle;  // the large ones reach everywhere
    for (size_t i = 0; i < 3; ++i) {
      middle.low[i] = middle.high[i] = (block.bounds.low[i] + block.bounds.high[i]) / 2;
    }
    const bool seen = std::any_of(frusta.begin(), frusta.end(),
                                  [&](const Frustum& view) { return view.MaySee(middle); });
    if (seen) box.extend(Eigen::Vector3f(middle.low.data()));
  }
  if (box.isEmpty()) return edit;
  const std::vector<const View*> views = ViewsThatSee(box);
  edit.views.insert(edit.views.end(), views.begin(), views.end());
  edit.completes = true;
  edit.everything = file_->count() <= kGraphOfWholeScene;
  edit.within = box;
  return edit;
}

void LargeScene::CheckFits(const Need& need, const std::function<std::string()>& or_else) const {
  EditSize size = SizeOf(need);
  const MemoryBytes bytes = BytesFor(size);
  if (large_.limits.Hold(bytes)) return;
  const std::string seen = std::to_string(size.views) + ", see " + std::to_string(size.gaussians) +
                           " of " + std::to_string(file_->count()) + " Gaussians";
  if (large_.refit && need.active == 0) size = SizeOf(EditOf(need));
  throw OptionError(TooLittle(large_.limits, bytes) + ": the views of this step, " + seen + "; " +
                    EnoughFor(size) + (or_else ? or_else() : ""));
}

std::string LargeScene::EnoughFor(EditSize size, size_t more) const {
  MemoryBytes bytes = BytesFor(size);
  size.on_device = false;
  const size_t besides = more + kSlack;
  bytes.host += besides;
  return Enough(large_.limits, bytes, BytesFor(size).host + besides);
}

std::unique_ptr<EditSession> LargeScene::Open(const Need& need, std::unique_ptr<EditSession> before,
                                              Monitor& monitor) {
  std::vector<uint32_t> blocks = BlocksOf(need);
  if (blocks.empty() && need.or_any && !index_->blocks().empty()) blocks.push_back(0);
  if (blocks.empty()) throw InputError(file_->path(), "the view sees no Gaussian");
  CheckFits(need);
  size_ = SizeOf(need);
  StageClock clock = clock_;
  if (before) {
    clock = before->scene().clock();
    before.reset();
    backend_->ReleaseFreed();
    ReleaseFreedMemory();
  }
  std::unique_ptr<OpenScene> scene;
  {
    const StageClock::Lap lap(clock, "load");
    ScenePart part;
    part.file = file_;
    part.backend = backend_;
    part.records = index_->Records(blocks);
    for (const View* view : need.views) part.views.insert(view->id);
    GaussianModel model = file_->Read(part.records, monitor);
    file_->CheckUnchanged();
    SessionOptions options = options_;
    const auto cache = [&, taken = BytesFor(size_)](MemorySide side, size_t wanted) {
      return CacheBeside(large_.limits, side, taken.On(side), wanted);
    };
    options.cache_bytes = cache(large_.limits.CacheSide(), options.cache_bytes);
    options.photo_bytes = cache(MemorySide::kHost, options.photo_bytes);
    scene = std::make_unique<OpenScene>(workspace_, std::move(model), options, std::move(part));
  }
  scene->clock() = clock;
  const auto count = static_cast<int64_t>(index_->CountOf(blocks));
  if (count >= report_.gaussians) {
    report_.gaussians = count;
    report_.blocks = static_cast<int64_t>(blocks.size());
  }
  report_.views = static_cast<int>(scene->views().size());
  return std::make_unique<EditSession>(std::move(scene));
}

std::unique_ptr<EditSession> LargeScene::Show(const std::vector<std::string>& pictures,
                                              std::unique_ptr<EditSession> before,
                                              Monitor& monitor) {
  Need need;
  need.views = FacesOf(pictures);
  return Open(need, std::move(before), monitor);
}

std::unique_ptr<EditSession> LargeScene::Show(const std::vector<const View*>& views,
                                              std::unique_ptr<EditSession> before,
                                              Monitor& monitor) {
  Need need;
  need.views = views;
  need.or_any = true;
  return Open(need, std::move(before), monitor);
}

std::unique_ptr<EditSession> LargeScene::ForDepth(const std::vector<PosedCamera>& views,
                                                  const SelectOptions& select,
                                                  std::unique_ptr<EditSession> before,
                                                  Monitor& monitor) {
  Need need;
  need.views = before->scene().views();
  const std::vector<uint32_t> shown = BlocksOf(need);
  before->scene().renderer().SetSh(before->scene().original().sh);
  const auto estimator = MakeDepthEstimator(select.depth_method, before->scene().renderer(),
                                            workspace_.get(), select.depth);
  for (const PosedCamera& view : views) {
    const std::vector<PosedCamera> cameras = estimator->Cameras(view, monitor);
    need.cameras.insert(need.cameras.end(), cameras.begin(), cameras.end());
  }
  if (BlocksOf(need) == shown) return before;
  return Open(need, std::move(before), monitor);
}

LargeScene::Need LargeScene::ComparisonOf(std::span<const View* const> views) {
  Need need;
  need.views.assign(views.begin(), views.end());
  need.or_any = true;
  need.active = 1;  // as the report on a fit does
  return need;
}

// Few views fit mostly, however many there are: their number is doubled while it does.
size_t LargeScene::NumToCompare(std::span<const View* const> views) const {
  const auto fits = [&](size_t count) {
    return large_.limits.Hold(BytesFor(SizeOf(ComparisonOf(views.first(count)))));
  };
  size_t low = 1, step = 1;
  while (low + step <= views.size() && fits(low + step)) {
    low += step;
    step *= 2;
  }
  for (; step > 0; step /= 2) {
    if (low + step <= views.size() && fits(low + step)) low += step;
  }
  return std::min(low, views.size());
}

std::unique_ptr<EditSession> LargeScene::ToCompare(std::span<const View* const> views,
                                                   std::unique_ptr<EditSession> before,
                                                   Monitor& monitor) {
  return Open(ComparisonOf(views), std::move(before), monitor);
}

void LargeScene::CountWhatIsHeld() {
  ReleaseFreedMemory();
  base_bytes_ = std::max(base_bytes_, ResidentBytes());
}

std::vector<uint32_t> LargeScene::RecordsOf(const std::vector<const View*>& selected, size_t bytes,
                                            const std::vector<const View*>& views) {
  Need need;
  need.views = selected;
  const std::vector<uint32_t> blocks = BlocksOf(need);
  const size_t count = index_->CountOf(blocks), held = count * (sizeof(uint32_t) + bytes);
  EditSize largest;
  for (const View* view : views) {
    const EditSize size = SizeOf(ComparisonOf(std::span(&view, 1)));
    if (HostBytesOf(size) > HostBytesOf(largest)) largest = size;
  }
  MemoryBytes taken = BytesFor(largest);
  taken.host += held;
  if (!large_.limits.Hold(taken)) {
    throw OptionError(TooLittle(large_.limits, taken) + ": one view sees " +
                      std::to_string(largest.gaussians) +
                      " Gaussians, and those with a selected pixel see " + std::to_string(count) +
                      "; " + EnoughFor(largest, held));
  }
  base_bytes_ += held;
  return blocks.empty() ? std::vector<uint32_t>() : index_->Records(blocks);
}

std::vector<const View*> LargeScene::ViewsThatSee(const Eigen::AlignedBox3f& box) const {
  GaussianBounds bounds;
  for (size_t i = 0; i < 3; ++i) {
    bounds.low[i] = box.min()[Eigen::Index(i)];
    bounds.high[i] = box.max()[Eigen::Index(i)];
  }
  std::vector<std::pair<double, const View*>> seen;  // by pixels that a unit of length takes
  for (const View* view : workspace_->reconstruction.ViewsByName()) {
    const PosedCamera posed = workspace_->reconstruction.Posed(*view);
    if (!FrustumOf(posed).MaySee(bounds)) continue;
    const double distance =
        box.exteriorDistance(Eigen::Vector3f(posed.Center().cast<float>())) + 1e-6F;
    seen.emplace_back(-posed.camera.fx() / distance, view);
  }
  return LeastFirst(std::move(seen));
}

std::unique_ptr<EditSession> LargeScene::ForSelections(
    const std::vector<const SelectionSource*>& selections, const std::vector<std::string>& pictures,
    std::unique_ptr<EditSession> before, Monitor& monitor) {
  Need need;
  need.views = FacesOf(pictures);
  std::vector<std::vector<const View*>> largest_of;  // a selection each
  for (const SelectionSource* selection : selections) {
    AddNeed(*selection, &need);
    largest_of.push_back(ViewsThatSee(BoxOf(selection->cloud)));
  }
  // In turn, so that each selection has its largest views if only some take part.
  std::vector<const View*> largest;
  std::set<const View*> taken;
  for (size_t i = 0; i < workspace_->reconstruction.views.size(); ++i) {
    for (const std::vector<const View*>& views : largest_of) {
      if (i < views.size() && taken.insert(views[i]).second) largest.push_back(views[i]);
    }
  }
  return OpenLargest(std::move(need), std::move(largest), std::move(before), monitor);
}

void LargeScene::AddNeed(const SelectionSource& selection, Need* need) const {
  const SelectionCloud& cloud = selection.cloud;
  if (cloud.points.empty()) throw InputError("the selection is empty: its cloud has no points");
  for (const PaintedView& view : selection.painted) {
    need->cameras.push_back(view.camera);
    const View* const found = workspace_->reconstruction.FindView(view.name);
    if (found) need->views.push_back(found);
  }
  if (selection.projector.Completes() && !selection.painted.empty()) {
    const bool near = selection.projector.completion == Completion::kNear;
    need->completes = true;
    if (near && file_->count() > kGraphOfWholeScene) {
      std::vector<Eigen::Vector3f> points;
      for (const SelectionPoint& point : cloud.points) points.push_back(point.position);
      Eigen::AlignedBox3f within = Surroundings(points);
      if (need->within) within.extend(*need->within);
      need->within = within;
    } else {
      need->everything = true;
    }
  }
  need->active += index_->CountOf(index_->Visible({}, BoxOf(cloud)));
}

std::unique_ptr<EditSession> LargeScene::ForMasks(const MaskFolder& masks,
                                                  const SparseShares& shares,
                                                  double active_threshold, Monitor& monitor) {
  const Pictures all = pictures();
  std::vector<std::pair<double, const View*>> selected;  // by how much is
  std::vector<const View*> others;
  Need need;
  for (const UserPicture& picture : all.all()) {
    const auto mask = masks.masks.find(picture.name);
    if (mask != masks.masks.end()) {
      double area = 0;
      for (const uint8_t value : mask->second.data) area += value;
      for (const View* face : picture.faces) selected.emplace_back(-area, face);
      need.views.insert(need.views.end(), picture.faces.begin(), picture.faces.end());
    } else if (std::binary_search(masks.empty.begin(), masks.empty.end(), picture.name)) {
      others.insert(others.end(), picture.faces.begin(), picture.faces.end());
    }
  }
  std::vector<const View*> largest = LeastFirst(std::move(selected));
  if (largest.empty()) throw InputError("no view's mask has a selected pixel");
  const uint64_t largest_selected = VisibleTo(workspace_->reconstruction.Posed(*largest.front()));
  std::vector<uint32_t> wanted;
  if (!others.empty()) {
    wanted = shares.known ? index_->Holding(shares.Above(active_threshold)) : BlocksOf(need);
  }
  for (const View* view : others) {
    const Frustum frustum = FrustumOf(workspace_->reconstruction.Posed(*view));
    const bool sees = std::any_of(wanted.begin(), wanted.end(), [&](uint32_t block) {
      return frustum.MaySee(index_->blocks()[block].bounds);
    });
    if (sees) largest.push_back(view);
  }
  Need fitted;
  fitted.active = shares.known ? shares.Above(active_threshold).size() : largest_selected;
  return OpenLargest(std::move(fitted), std::move(largest), nullptr, monitor);
}

std::unique_ptr<EditSession> LargeScene::OpenLargest(Need need, std::vector<const View*> largest,
                                                     std::unique_ptr<EditSession> before,
                                                     Monitor& monitor) {
  if (large_.most_views > 0 && largest.size() > static_cast<size_t>(large_.most_views)) {
    largest.resize(static_cast<size_t>(large_.most_views));
  }
  Need all = need;
  all.views.insert(all.views.end(), largest.begin(), largest.end());
  CheckFits(all, [&]() -> std::string {
    if (need.everything)
      return ", or " + OptionName("completion", "near") + " or off, which looks at less than all";
    const size_t fit = ViewsThatFit(need, largest);
    if (fit == 0) return "";
    return ", or " + OptionName("most_views", std::to_string(fit)) +
           ", which takes those that see the selection largest";
  });
  return Open(all, std::move(before), monitor);
}

}  // namespace retint
