// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <set>
#include <system_error>
#include <utility>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "scene/image_checks.h"
#include "session/photo_paint.h"
#include "session/session_file.h"
#include "session/session_json.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using session_json::Json;
using session_json::Node;

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
void CheckSum(const Node& node, const fs::path& path) {
  const FileChecksum expected = ReadSum(node);
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

class Reader {
 public:
  Reader(const fs::path& folder, const EditSession& session, Monitor& monitor)
      : folder_(folder), session_(session), monitor_(monitor) {}

  RegionSet Regions(const Node& root, const RefitJob& job);
  std::shared_ptr<const SelectionSource> Draft(const Node& node);

 private:
  std::map<std::string, Mask> Masks(const Node& list, const fs::path& folder);
  PosedCamera PaintedOn(const std::string& name, const Node& node) const;
  SelectionSource Source(const Node& node, const fs::path& folder);
  std::shared_ptr<const RegionSelection> Selection(const Node& node);
  std::shared_ptr<const RegionFit> Fit(const Node& node, std::string current_key);

  const fs::path& folder_;
  const EditSession& session_;
  Monitor& monitor_;
};

std::map<std::string, Mask> Reader::Masks(const Node& list, const fs::path& folder) {
  std::map<std::string, Mask> masks;
  const std::vector<Node> nodes = list.List();
  for (const Node& node : nodes) {
    monitor_.Step("load", static_cast<double>(masks.size()), static_cast<double>(nodes.size()));
    const std::string name = node.At("view").Bytes();
    const View* view = session_.reconstruction().FindView(name);
    if (!view) node.Fail("the workspace has no view " + name);
    if (masks.count(name) > 0) node.Fail("view " + name + " comes twice");
    const Camera& camera = session_.reconstruction().Posed(*view).camera;
    const fs::path path = ViewFile(folder, name);
    CheckSum(node, path);
    masks.emplace(name, ReadMask(path, camera.width, camera.height));
  }
  return masks;
}

// Of a photo the workspace's own: its paint says which pixels, whatever the lens is believed to be.
PosedCamera Reader::PaintedOn(const std::string& name, const Node& node) const {
  const PosedCamera camera = session_json::ReadCamera(node);
  if (camera.camera.IsPinhole()) return camera;
  const Workspace& workspace = session_.workspace();
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
    const fs::path path = ViewFile(folder / "painted", view.name);
    CheckSum(painted, path);
    view.mask = ReadMask(path, view.camera.camera.width, view.camera.camera.height);
    source.painted.push_back(std::move(view));
  }
  for (const Node& report : node.At("reports").List()) {
    source.reports.push_back(session_json::ReadReport(report));
  }
  if (node.At("cloud").IsNull()) return source;
  const fs::path path = folder / "cloud.ply";
  CheckSum(node.At("cloud"), path);
  source.cloud = ReadCloud(path);
  for (const SelectionPoint& point : source.cloud.points) {
    if (!point.position.allFinite()) throw InputError(path, "holds a point that is not finite");
  }
  return source;
}

std::shared_ptr<const RegionSelection> Reader::Selection(const Node& node) {
  auto selection = std::make_shared<RegionSelection>();
  selection->id = node.At("id").Unsigned(std::numeric_limits<uint64_t>::max() - 1);
  if (selection->id == 0) node.At("id").Fail("is 0");
  const fs::path folder = folder_ / PartName(node.At("folder"), "selection-");
  selection->masks = Masks(node.At("masks"), folder / "masks");
  const bool any = std::any_of(selection->masks.begin(), selection->masks.end(),
                               [](const auto& entry) { return AnySet(entry.second); });
  if (!any) node.At("masks").Fail("no mask has a selected pixel");
  const fs::path path = folder / "shares.bin";
  CheckSum(node.At("shares"), path);
  const size_t count = session_.original().NumGaussians();
  const std::string bytes = ReadFile(path);
  if (bytes.size() != count * sizeof(float)) {
    throw InputError(path, "holds " + std::to_string(bytes.size()) + " bytes, not " +
                               std::to_string(count * sizeof(float)) + " for " +
                               std::to_string(count) + " Gaussians");
  }
  selection->shares = Values<float>(bytes);
  for (const float share : selection->shares) {
    if (!std::isfinite(share)) throw InputError(path, "holds a share that is not finite");
  }
  selection->source = Source(node, folder);
  return selection;
}

std::shared_ptr<const RegionFit> Reader::Fit(const Node& node, std::string current_key) {
  auto fit = std::make_shared<RegionFit>();
  const GaussianModel& model = session_.original();
  const size_t block = static_cast<size_t>(model.NumShCoeffs()) * 3;
  const size_t count = node.At("count").Unsigned(model.NumGaussians());
  const fs::path path = folder_ / PartName(node.At("file"), "fit-");
  CheckSum(node, path);
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
  return fit;
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
    if (!fit.IsNull()) set.regions[i].fit = Fit(fit, set.FitKey(i, job));
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
      CheckSum(views.At(file), info.view_folder / file);
    }
  }
  // Sessions of earlier programs have neither.
  if (root.Has("model")) info.model = root.At("model").Text();
  if (root.Has("world_from_splat")) {
    info.world_from_splat = session_json::ReadSimilarity(root.At("world_from_splat"));
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

OpenedSession OpenOnce(const fs::path& folder, SessionOptions options, Monitor& monitor) {
  const Json json = session_json::ReadManifest(folder);
  const fs::path path = folder / session_json::kManifest;
  const SessionInfo info = InfoFrom(json, folder);
  if (info.view_folder.empty() && !IsFolder(info.workspace)) {
    throw InputError(path, "its workspace is not there: " + info.workspace.string());
  }
  if (!IsFile(info.splat)) {
    throw InputError(path, "its splat is not there: " + info.splat.string());
  }
  const FileChecksum found = ChecksumFile(info.splat);
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
  options.holdout = info.holdout;
  options.background = info.background;
  OpenedSession opened;
  try {
    opened.session = EditSession::Open(info.workspace, info.splat, options, monitor);
  } catch (const OptionError& error) {
    throw InputError(path, error.what());
  }
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
  const auto manifest = [&] {
    return IsFile(root / session_json::kManifest) ? ReadFile(root / session_json::kManifest) : "";
  };
  // A session that is saved while it is read may lose a part under the reader's hands: then there
  // is a newer one to read.
  for (int attempt = 0;; ++attempt) {
    const std::string before = manifest();
    try {
      return OpenOnce(root, options, monitor);
    } catch (const InputError&) {
      if (attempt == 3 || manifest() == before) throw;
    }
  }
}

}  // namespace retint
