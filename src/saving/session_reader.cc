// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <set>
#include <system_error>
#include <utility>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "opening/photo_paint.h"
#include "saving/session_file.h"
#include "saving/session_json.h"
#include "scene/image_checks.h"
#include "splat_io/splat_checksum.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using json::Json;
using json::Node;

constexpr uint64_t kMostBytes = uint64_t{1} << 40;

// The name of a part, which must not lead out of the session's folder.
std::string PartName(const Node& node, const char* prefix) {
  const std::string name = node.Text();
  const bool plain = name.find_first_of("/\\") == std::string::npos &&
                     name.find('\0') == std::string::npos && name.rfind(prefix, 0) == 0;
  if (!plain) node.Fail("'" + name + "' is not the name of a part");
  return name;
}

FileChecksum ReadSum(const Node& node) {
  return {node.At("bytes").Unsigned(kMostBytes), node.At("xxh64").Hex()};
}

// The size is compared first, so that a changed file is refused before it is read.
void CheckSum(const FileChecksum& expected, const fs::path& path) {
  std::error_code code;
  if (!IsFile(path)) throw InputError(path, "is missing from the session");
  const uint64_t bytes = fs::file_size(path, code);
  if (code) throw InputError(path, code.message());
  if (bytes != expected.bytes) {
    throw InputError(path, (bytes < expected.bytes ? "truncated: has " : "has ") +
                               std::to_string(bytes) + " bytes, the session wrote " +
                               std::to_string(expected.bytes));
  }
  if (ChecksumFile(path) != expected) {
    throw InputError(path, "is damaged: its checksum is not the one that the session wrote");
  }
}

template <typename T>
std::vector<T> Values(std::string_view bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

std::vector<float> ReadShares(const fs::path& path, size_t count) {
  const std::string bytes = ReadFile(path);
  if (bytes.size() != count * sizeof(float)) {
    throw InputError(path, "holds " + std::to_string(bytes.size()) + " bytes, not " +
                               std::to_string(count * sizeof(float)) + " for " +
                               std::to_string(count) + " Gaussians");
  }
  std::vector<float> shares = Values<float>(bytes);
  for (const float share : shares) {
    if (!std::isfinite(share)) throw InputError(path, "holds a share that is not finite");
  }
  return shares;
}

// Parts that were made of others, and can be again, do not keep a session from opening: if one
// cannot be read, the session has a warning.
class Reader {
 public:
  Reader(const fs::path& folder, EditSession& session, Monitor& monitor)
      : folder_(folder), session_(session), monitor_(monitor) {}

  RegionSet Regions(const Node& root, const RefitJob& job);
  std::shared_ptr<const SelectionSource> Draft(const Node& node);

 private:
  // False, and a warning that ends with `again`, where `read` throws an InputError.
  template <typename Read>
  bool ReadDerived(const std::string& again, const Read& read);
  // Adds the names of views whose mask cannot be read to `unread`; null: that is an InputError.
  std::map<std::string, Mask> Masks(const Node& list, const fs::path& folder,
                                    std::vector<const View*>* unread);
  PosedCamera PaintedOn(const std::string& name, const Node& node) const;
  SelectionSource Source(const Node& node, const fs::path& folder);
  void FindCloudAgain(SelectionSource& source);
  void MakeAgain(RegionSelection& selection, const std::vector<const View*>& views);
  std::shared_ptr<const RegionSelection> Selection(const Node& node);
  std::shared_ptr<const RegionFit> Fit(const Node& node, const std::string& region,
                                       std::string current_key);

  const fs::path& folder_;
  EditSession& session_;
  Monitor& monitor_;
};

template <typename Read>
bool Reader::ReadDerived(const std::string& again, const Read& read) {
  try {
    read();
    return true;
  } catch (const InputError& error) {
    session_.Warn(std::string(error.what()) + "; " + again);
    return false;
  }
}

std::map<std::string, Mask> Reader::Masks(const Node& list, const fs::path& folder,
                                          std::vector<const View*>* unread) {
  std::map<std::string, Mask> masks;
  const std::vector<Node> nodes = list.List();
  for (const Node& node : nodes) {
    monitor_.Step("load", static_cast<double>(masks.size()), static_cast<double>(nodes.size()));
    const std::string name = node.At("view").Bytes();
    const View* view = session_.scene().reconstruction().FindView(name);
    if (!view) node.Fail("the workspace has no view " + name);
    if (masks.count(name) > 0) node.Fail("view " + name + " comes twice");
    const Camera& camera = session_.scene().reconstruction().Posed(*view).camera;
    const fs::path path = ViewFile(folder, name);
    const FileChecksum sum = ReadSum(node);
    Mask& mask = masks[name];
    const auto read = [&] {
      CheckSum(sum, path);
      mask = ReadMask(path, camera.width, camera.height);
    };
    if (!unread) {
      read();
    } else if (!ReadDerived("the selection in this view was found again", read)) {
      unread->push_back(view);
    }
  }
  monitor_.Step("load", 1, 1);
  return masks;
}

// Of a photo the workspace's own: its paint says which pixels, whatever the lens is believed to be.
PosedCamera Reader::PaintedOn(const std::string& name, const Node& node) const {
  const PosedCamera camera = session_json::ReadCamera(node);
  if (camera.camera.IsPinhole()) return camera;
  const Workspace& workspace = session_.scene().workspace();
  const DistortedPhoto* photo =
      workspace.photo_pixels ? workspace.photo_pixels->FindPhoto(name) : nullptr;
  if (!photo) node.Fail("the workspace has no distorted photo " + name);
  const PosedCamera own = PosedPhoto(workspace, *photo);
  const Camera &is = own.camera, &was = camera.camera;
  if (is.width != was.width || is.height != was.height) {
    node.Fail("is " + SizeText(was.width, was.height) + ", the photo " + name + " is " +
              SizeText(is.width, is.height));
  }
  return own;
}

SelectionSource Reader::Source(const Node& node, const fs::path& folder) {
  SelectionSource source;
  std::set<std::string> names;
  for (const Node& painted : node.At("painted").List()) {
    PaintedView view;
    view.name = painted.At("view").Bytes();
    if (!names.insert(view.name).second) painted.Fail("view " + view.name + " comes twice");
    view.camera = PaintedOn(view.name, painted.At("camera"));
    if (painted.Has("outlined_by")) view.outlined_by = painted.At("outlined_by").Bytes();
    const fs::path path = ViewFile(folder / "painted", view.name);
    CheckSum(ReadSum(painted), path);
    view.mask = ReadMask(path, view.camera.camera.width, view.camera.camera.height);
    source.painted.push_back(std::move(view));
  }
  if (node.Has("options")) {
    session_json::ReadSelection(node.At("options"), &source.select, &source.projector);
  }
  for (const Node& report : node.At("reports").List()) {
    source.reports.push_back(session_json::ReadReport(report));
  }
  if (node.At("cloud").IsNull()) return source;
  const fs::path path = folder / "cloud.ply";
  const FileChecksum sum = ReadSum(node.At("cloud"));
  const auto read = [&] {
    CheckSum(sum, path);
    source.cloud = ReadCloud(path);
    for (const SelectionPoint& point : source.cloud.points) {
      if (!point.position.allFinite()) throw InputError(path, "holds a point that is not finite");
    }
  };
  if (source.painted.empty()) {
    read();
  } else if (!ReadDerived("the selection's points were found again", read)) {
    FindCloudAgain(source);
  }
  return source;
}

// Leaves the cloud empty if no painted pixel has a depth.
void Reader::FindCloudAgain(SelectionSource& source) {
  std::vector<PaintedReport> saved = std::move(source.reports);
  source.cloud = {};
  const auto select = [&] {
    try {
      session_.selection().Select(source, monitor_);
    } catch (const NoDepthError&) {
    }
  };
  try {
    select();
  } catch (const Cancelled&) {
    throw;
  } catch (const std::runtime_error& error) {
    // Its depth method needs depth maps or a program that are not there any more.
    session_.Warn(std::string(error.what()) +
                  "; the options of the selection are the defaults now");
    source.select = {};
    select();
  }
  source.reports = std::move(saved);
}

// Makes the masks of `views`, and missing shares, from the other data of a selection.
void Reader::MakeAgain(RegionSelection& selection, const std::vector<const View*>& views) {
  const bool has_shares = !selection.shares.empty();
  if (!views.empty() && !has_shares) {
    ProjectedMasks projected = session_.selection().Project(selection.source, monitor_);
    for (const View* view : views) selection.masks[view->name] = projected.masks[view->name];
    std::erase_if(selection.masks, [](const auto& entry) { return entry.second.Empty(); });
    selection.shares = std::move(projected.shares);
  } else if (!has_shares) {
    selection.shares = session_.store().SharesOf(selection.masks, monitor_);
  } else {
    const std::vector<PaintedView> painted =
        OnViews(session_.scene().workspace(), selection.source.painted);
    for (const View* view : views) {
      const auto by_hand = std::ranges::find(painted, view->name, &PaintedView::name);
      selection.masks[view->name] =
          by_hand != painted.end() ? by_hand->mask
                                   : session_.selection().SeenFrom(
                                         selection, session_.scene().reconstruction().Posed(*view));
    }
  }
}

std::shared_ptr<const RegionSelection> Reader::Selection(const Node& node) {
  auto selection = std::make_shared<RegionSelection>();
  selection->id = node.At("id").Unsigned(std::numeric_limits<uint64_t>::max() - 1);
  if (selection->id == 0) node.At("id").Fail("is 0");
  const fs::path folder = folder_ / PartName(node.At("folder"), "selection-");
  selection->source = Source(node, folder);
  // Masks that nobody painted are from elsewhere.
  const bool is_painted = !selection->source.painted.empty();
  std::vector<const View*> unread;
  selection->masks = Masks(node.At("masks"), folder / "masks", is_painted ? &unread : nullptr);
  const fs::path path = folder / "shares.bin";
  const FileChecksum sum = ReadSum(node.At("shares"));
  ReadDerived("how much of each Gaussian is selected was found again", [&] {
    CheckSum(sum, path);
    selection->shares = ReadShares(path, session_.scene().original().NumGaussians());
  });
  try {
    MakeAgain(*selection, unread);
  } catch (const InputError& error) {
    throw InputError(folder, std::string("cannot be read, nor be made again: ") + error.what());
  }
  const bool any = std::any_of(selection->masks.begin(), selection->masks.end(),
                               [](const auto& entry) { return AnySet(entry.second); });
  if (!any) node.At("masks").Fail("no mask has a selected pixel");
  return selection;
}

// Into `fit`: its Gaussians and their coefficients.
void ReadFit(const fs::path& path, size_t count, const GaussianModel& model, RegionFit* fit) {
  const size_t block = static_cast<size_t>(model.NumShCoeffs()) * 3;
  const std::string bytes = ReadFile(path);
  const size_t index_bytes = count * sizeof(int32_t);
  if (bytes.size() != index_bytes + count * block * sizeof(float)) {
    throw InputError(path, "holds " + std::to_string(bytes.size()) + " bytes, not " +
                               std::to_string(index_bytes + count * block * sizeof(float)));
  }
  fit->indices = Values<int32_t>(std::string_view(bytes).substr(0, index_bytes));
  const auto values = Values<float>(std::string_view(bytes).substr(index_bytes));
  fit->sh.assign(values.begin(), values.end());
  for (size_t i = 0; i < count; ++i) {
    const int64_t index = fit->indices[i], before = i == 0 ? -1 : fit->indices[i - 1];
    if (index <= before || index >= static_cast<int64_t>(model.NumGaussians())) {
      throw InputError(path, "index " + std::to_string(i) + " is not ascending or no Gaussian's");
    }
  }
  for (const float value : fit->sh) {
    if (!std::isfinite(value)) throw InputError(path, "holds a coefficient that is not finite");
  }
}

// Null where it has to be computed again.
std::shared_ptr<const RegionFit> Reader::Fit(const Node& node, const std::string& region,
                                             std::string current_key) {
  auto fit = std::make_shared<RegionFit>();
  const size_t count = node.At("count").Unsigned(session_.scene().original().NumGaussians());
  const fs::path path = folder_ / PartName(node.At("file"), "fit-");
  const FileChecksum sum = ReadSum(node);
  const bool is_read =
      ReadDerived("the optimizer will make the fit of region '" + region + "' again", [&] {
        CheckSum(sum, path);
        ReadFit(path, count, session_.scene().original(), fit.get());
      });
  if (node.At("current").Bool()) {
    fit->key = std::move(current_key);
  } else {
    const std::string hex = node.At("key").Text();
    if (hex.size() % 2 != 0 || hex.find_first_not_of("0123456789abcdef") != std::string::npos) {
      node.At("key").Fail("is not hexadecimal");
    }
    for (size_t i = 0; i < hex.size(); i += 2) {
      fit->key += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
    }
  }
  fit->summary = session_json::ReadSummary(node.At("summary"));
  return is_read ? fit : nullptr;
}

RegionSet Reader::Regions(const Node& root, const RefitJob& job) {
  std::vector<std::shared_ptr<const RegionSelection>> selections;
  std::set<uint64_t> selection_ids;
  for (const Node& node : root.At("selections").List()) {
    selections.push_back(Selection(node));
    if (!selection_ids.insert(selections.back()->id).second) node.At("id").Fail("comes twice");
  }
  RegionSet set;
  const std::vector<Node> nodes = root.At("regions").List();
  for (const Node& node : nodes) {
    Region region;
    session_json::ReadEdit(node, &region);
    if (set.Find(region.id)) node.At("id").Fail("comes twice");
    const Node index = node.At("selection");
    if (index.Unsigned() >= selections.size()) index.Fail("there is no such selection");
    region.selection = selections[index.Unsigned()];
    set.regions.push_back(std::move(region));
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    const Node fit = nodes[i].At("fit");
    if (!fit.IsNull()) set.regions[i].fit = Fit(fit, set.regions[i].name, set.FitKey(i, job));
  }
  return set;
}

std::shared_ptr<const SelectionSource> Reader::Draft(const Node& node) {
  if (node.IsNull()) return nullptr;
  const fs::path folder = folder_ / PartName(node.At("folder"), "draft-");
  return std::make_shared<const SelectionSource>(Source(node, folder));
}

template <typename Exists>
fs::path FirstOf(const Node& node, const fs::path& folder, Exists exists) {
  const std::vector<fs::path> paths = session_json::ReadPaths(node, folder);
  const auto found = std::find_if(paths.begin(), paths.end(), exists);
  return found == paths.end() ? paths.back() : *found;
}

SessionInfo InfoFrom(const Json& json, const fs::path& folder) {
  const fs::path path = folder / session_json::kManifest;
  const Node root(json, path, "");
  SessionInfo info;
  info.written_by = root.At("written_by").Text();
  if (!root.At("workspace").IsNull()) {
    info.workspace = FirstOf(root.At("workspace"), folder, IsFolder);
  } else {
    const Node views = root.At("views");
    info.view_folder = folder / PartName(views.At("folder"), "views-");
    for (const char* file : session_json::kViewFiles) {
      CheckSum(ReadSum(views.At(file)), info.view_folder / file);
    }
  }
  // Sessions of earlier programs lack these.
  if (root.Has("model")) info.model = root.At("model").Text();
  if (root.Has("world_from_splat")) {
    info.world_from_splat = session_json::ReadSimilarity(root.At("world_from_splat"));
  }
  if (root.Has("render_model") && !root.At("render_model").IsNull()) {
    const Node name = root.At("render_model");
    info.render_model = ChosenRenderModel(name.Text());
    if (!info.render_model) name.Fail("is not default or mip");
  }
  if (root.Has("space")) {
    info.space.name = root.At("space").Text();
    const Node config = root.At("ocio");
    info.space.config =
        config.json().is_string() ? config.Text() : FirstOf(config, folder, IsFile).string();
  }
  if (!root.At("images").IsNull()) {
    info.image_folder = FirstOf(root.At("images"), folder, IsFolder);
  }
  const Node splat = root.At("splat");
  info.checksum = ReadSum(splat);
  // Of two files that are there, the one that was edited.
  info.splat = FirstOf(splat, folder, [&](const fs::path& candidate) {
    std::error_code code;
    return IsFile(candidate) && fs::file_size(candidate, code) == info.checksum.bytes;
  });
  if (!IsFile(info.splat)) info.splat = FirstOf(splat, folder, IsFile);
  if (!root.At("saved").IsNull()) info.saved = FirstOf(root.At("saved"), folder, IsFolder);
  info.holdout = root.At("holdout").Int(0, std::numeric_limits<int>::max());
  const std::vector<Node> background = root.At("background").List(3);
  for (size_t c = 0; c < 3; ++c) info.background[c] = background[c].Float();
  info.regions = root.At("regions").List().size();
  return info;
}

// The splat's sum. In sessions of earlier programs it is that of the named file alone.
FileChecksum SumLike(const FileChecksum& expected, const fs::path& splat) {
  const FileChecksum named = ChecksumFile(splat);
  if (named == expected || named.bytes != expected.bytes) return named;
  try {
    return ChecksumSplat(splat);
  } catch (const InputError&) {  // it is no splat any more
    return named;
  }
}

// `is_whole`: whether no part of it was missing or damaged.
OpenedSession OpenOnce(const fs::path& folder, SessionOptions options, Monitor& monitor,
                       bool* is_whole) {
  const Json json = session_json::ReadManifest(folder);
  const fs::path path = folder / session_json::kManifest;
  const SessionInfo info = InfoFrom(json, folder);
  if (info.view_folder.empty() && !IsFolder(info.workspace)) {
    throw InputError(path, "its workspace is not there: " + info.workspace.string());
  }
  if (!IsFile(info.splat)) {
    throw InputError(path, "its splat is not there: " + info.splat.string());
  }
  const FileChecksum found = SumLike(info.checksum, info.splat);
  if (found != info.checksum) {
    throw InputError(info.splat, "is not the splat that the session " + folder.filename().string() +
                                     " edited: it has " + std::to_string(found.bytes) +
                                     " bytes, checksum " + HexText(found.xxh64) +
                                     "; the session's had " + std::to_string(info.checksum.bytes) +
                                     ", " + HexText(info.checksum.xxh64));
  }
  options.image_folder = info.image_folder;
  options.view_folder = info.view_folder;
  options.model = info.model;
  options.world_from_splat = info.world_from_splat;
  if (!options.render_model) options.render_model = info.render_model;
  if (options.space == OcioSpace()) options.space = info.space;
  options.holdout = info.holdout;
  options.background = info.background;
  OpenedSession opened;
  try {
    opened.session = EditSession::Open(info.workspace, info.splat, options, monitor);
  } catch (const OptionError& error) {
    throw InputError(path, error.what());
  }
  const size_t of_scene = opened.session->warnings().size();
  const Node root(json, path, "");
  const RefitJob job = session_json::ReadJob(root.At("refit"));
  Reader reader(folder, *opened.session, monitor);
  RegionSet regions = reader.Regions(root, job);
  opened.draft = reader.Draft(root.At("draft"));
  const Json& view = root.At("view").json();
  if (!view.is_object()) root.At("view").Fail("is not an object");
  if (!view.empty()) opened.view = view.dump(-1, ' ', false, Json::error_handler_t::replace);
  try {
    opened.session->RestoreRegions(std::move(regions), job);
  } catch (const InputError& error) {
    throw InputError(path, error.what());
  }
  opened.saved = info.saved;
  *is_whole = opened.session->warnings().size() == of_scene;
  return opened;
}

}  // namespace

SessionInfo ReadSessionInfo(const fs::path& folder) {
  return InfoFrom(session_json::ReadManifest(folder), folder);
}

OpenedSession OpenSession(const fs::path& folder, const SessionOptions& options, Monitor& monitor) {
  const fs::path root = [&] {
    const fs::path normal = fs::absolute(folder).lexically_normal();
    return normal.has_filename() ? normal : normal.parent_path();
  }();
  // Names of parts come again, so that one saved twice meanwhile may have the same text.
  const auto manifest = [&] {
    const fs::path path = root / session_json::kManifest;
    std::error_code code;
    const auto written = fs::last_write_time(path, code).time_since_epoch().count();
    return std::pair(written, IsFile(path) ? ReadFile(path) : "");
  };
  // A session that is saved while it is read may lose a part under the reader's hands: then there
  // is a newer one to read.
  for (int attempt = 0;; ++attempt) {
    const auto before = manifest();
    try {
      bool is_whole = false;
      OpenedSession opened = OpenOnce(root, options, monitor, &is_whole);
      if (is_whole || manifest() == before) return opened;
      if (attempt == 3) throw InputError(root, "is saved again and again while it is read");
    } catch (const InputError&) {
      if (attempt == 3 || manifest() == before) throw;
    }
  }
}

}  // namespace retint
