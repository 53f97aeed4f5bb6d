// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "base/files.h"
#include "base/hidden.h"
#include "base/input_guard.h"
#include "base/run_clock.h"
#include "colmap_io/image_io.h"
#include "colmap_io/sparse.h"
#include "saving/session_file.h"
#include "saving/session_json.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using json::Json;

static_assert(std::endian::native == std::endian::little, "parts are little-endian");

constexpr const char* kPartPrefixes[] = {"selection-", "draft-", "fit-", "views-"};

// Removes a folder or file that was begun, unless it was finished.
class Scratch {
 public:
  explicit Scratch(fs::path path) : path_(std::move(path)) {}
  ~Scratch() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  Scratch(Scratch&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  Scratch& operator=(Scratch&&) = delete;
  void Keep() { path_.clear(); }

 private:
  fs::path path_;
};

Json FileJson(const fs::path& path) {
  const FileChecksum sum = ChecksumFile(path);
  return {{"bytes", sum.bytes}, {"xxh64", HexText(sum.xxh64)}};
}

// Of a part, which is nobody's until session.json names it: one of hundreds, so not each brought
// to the disk on its own. Sync() brings all.
Json WriteSmallFile(const fs::path& path, std::string_view bytes) {
  std::error_code code;
  fs::create_directories(path.parent_path(), code);
  if (code) {
    throw RunError(path.string() + ": cannot write: " + path.parent_path().string() + ": " +
                   code.message());
  }
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  ssize_t wrote = fd < 0 ? -1 : 0;
  for (size_t done = 0; wrote >= 0 && done < bytes.size(); done += static_cast<size_t>(wrote)) {
    wrote = write(fd, bytes.data() + done, bytes.size() - done);
    if (wrote < 0 && errno == EINTR) wrote = 0;
  }
  int reason = wrote < 0 ? errno : 0;
  if (fd >= 0 && close(fd) != 0 && reason == 0) reason = errno;
  if (reason != 0) throw RunError(path.string() + ": cannot write: " + std::strerror(reason));
  return {{"bytes", bytes.size()}, {"xxh64", HexText(Xxh64(bytes))}};
}

void Sync(const fs::path& folder) {
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool good = fd >= 0 && syncfs(fd) == 0;
  const int reason = errno;
  if (fd >= 0) close(fd);
  if (!good) throw RunError(folder.string() + ": cannot write: " + std::strerror(reason));
}

template <typename Values>
void WriteValues(AtomicFile& file, const Values& values) {
  file.Write(values.data(), values.size() * sizeof(values[0]));
}

std::string HexBytes(std::string_view bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    text += kDigits[static_cast<unsigned char>(c) >> 4];
    text += kDigits[static_cast<unsigned char>(c) & 15];
  }
  return text;
}

Json WriteMaskFile(const fs::path& folder, const std::string& name, const Mask& mask) {
  const fs::path path = ViewFile(folder, name);
  Json entry = WriteSmallFile(path, EncodePng(mask));
  entry["view"] = EscapeBytes(name);
  return entry;
}

Json WriteMaskFiles(const fs::path& folder, const std::map<std::string, Mask>& masks,
                    Monitor& monitor) {
  Json list = Json::array();
  for (const auto& [name, mask] : masks) {
    monitor.Step("save", static_cast<double>(list.size()), static_cast<double>(masks.size()));
    list.push_back(WriteMaskFile(folder, name, mask));
  }
  monitor.Step("save", 1, 1);
  return list;
}

void WriteSource(const fs::path& folder, const SelectionSource& source, Json* entry,
                 Monitor& monitor) {
  Json painted = Json::array();
  for (const PaintedView& view : source.painted) {
    monitor.Step("save", static_cast<double>(painted.size()),
                 static_cast<double>(source.painted.size()));
    Json one = WriteMaskFile(folder / "painted", view.name, view.mask);
    one["camera"] = session_json::CameraJson(view.camera);
    if (!view.outlined_by.empty()) one["outlined_by"] = EscapeBytes(view.outlined_by);
    painted.push_back(std::move(one));
  }
  monitor.Step("save", 1, 1);
  (*entry)["painted"] = std::move(painted);
  (*entry)["options"] = session_json::SelectionJson(source.select, source.projector);
  Json reports = Json::array();
  for (const PaintedReport& report : source.reports) {
    reports.push_back(session_json::ReportJson(report));
  }
  (*entry)["reports"] = std::move(reports);
  (*entry)["cloud"] = nullptr;
  if (source.cloud.points.empty()) return;
  WriteCloud(folder / "cloud.ply", source.cloud);
  (*entry)["cloud"] = FileJson(folder / "cloud.ply");
}

bool IsPart(const std::string& name) {
  return std::any_of(std::begin(kPartPrefixes), std::end(kPartPrefixes),
                     [&](const char* prefix) { return name.rfind(prefix, 0) == 0; }) ||
         (name.rfind(".retint-", 0) == 0 && name.ends_with(".tmp"));
}

void RemoveUnused(const fs::path& folder, const std::set<std::string>& used) {
  std::error_code ignored;
  for (const fs::path& path : ListFolder(folder)) {
    const std::string name = path.filename().string();
    if (IsPart(name) && used.count(name) == 0) fs::remove_all(path, ignored);
  }
}

}  // namespace

struct SessionWriter::Impl {
  // The part on disk of a value of the session. The owner tells whether the address is still that
  // value's.
  struct Part {
    std::weak_ptr<const void> owner;
    std::string name;
    Json entry;
  };
  // One Write().
  struct Run {
    fs::path root;
    std::map<const void*, Part> parts;  // of this session
    std::vector<Scratch> fresh;
    std::set<std::string> names() const {
      std::set<std::string> all;
      for (const auto& [address, part] : parts) all.insert(part.name);
      return all;
    }
  };

  // The entry of `value`, written by `write` (which gets the path) unless that was done before.
  template <typename T, typename Write>
  const Part& Require(Run& run, const std::shared_ptr<const T>& value, const std::string& stem,
                      const std::string& suffix, Write write) {
    const void* key = value.get();
    if (const auto done = run.parts.find(key); done != run.parts.end()) return done->second;
    std::error_code ignored;
    const auto old = written.find(key);
    if (old != written.end() && old->second.owner.lock().get() == key &&
        fs::exists(run.root / old->second.name, ignored)) {
      return run.parts.emplace(key, old->second).first->second;
    }
    Part part{value, {}, {}};
    do {
      part.name = stem + std::to_string(next++) + suffix;
    } while (fs::exists(run.root / part.name, ignored));
    run.fresh.emplace_back(run.root / part.name);
    part.entry = write(run.root / part.name);
    return run.parts.emplace(key, std::move(part)).first->second;
  }

  Json Selections(Run& run, const SessionSnapshot& snapshot,
                  std::map<const void*, size_t>* index_of, Monitor& monitor);
  Json Regions(Run& run, const SessionSnapshot& snapshot,
               const std::map<const void*, size_t>& index_of, Monitor& monitor);
  Json Manifest(Run& run, const SessionSnapshot& snapshot, const fs::path& folder,
                Monitor& monitor);

  std::map<const void*, Part> written;
  std::string manifest;  // as it was written last
  uint64_t next = 1;
};

Json SessionWriter::Impl::Selections(Run& run, const SessionSnapshot& snapshot,
                                     std::map<const void*, size_t>* index_of, Monitor& monitor) {
  Json list = Json::array();
  for (const Region& region : snapshot.regions.regions) {
    const auto& selection = region.selection;
    if (!index_of->emplace(selection.get(), list.size()).second) continue;
    const Part& part = Require(run, selection, "selection-", "", [&](const fs::path& folder) {
      Json entry = {{"id", selection->id}, {"folder", folder.filename().string()}};
      entry["masks"] = WriteMaskFiles(folder / "masks", selection->masks, monitor);
      AtomicFile shares(folder / "shares.bin");
      WriteValues(shares, selection->shares);
      shares.Commit();
      entry["shares"] = FileJson(folder / "shares.bin");
      WriteSource(folder, selection->source, &entry, monitor);
      return entry;
    });
    list.push_back(part.entry);
  }
  return list;
}

Json SessionWriter::Impl::Regions(Run& run, const SessionSnapshot& snapshot,
                                  const std::map<const void*, size_t>& index_of, Monitor& monitor) {
  Json list = Json::array();
  const auto& regions = snapshot.regions.regions;
  for (size_t i = 0; i < regions.size(); ++i) {
    const Region& region = regions[i];
    Json entry = session_json::EditJson(region);
    entry["selection"] = index_of.at(region.selection.get());
    entry["fit"] = nullptr;
    if (region.fit) {
      monitor.Step("save", static_cast<double>(i), static_cast<double>(regions.size()));
      const Part& part = Require(run, region.fit, "fit-", ".bin", [&](const fs::path& path) {
        AtomicFile file(path);
        WriteValues(file, region.fit->indices);
        WriteValues(file, region.fit->sh);
        file.Commit();
        Json fit = FileJson(path);
        fit["file"] = path.filename().string();
        fit["count"] = region.fit->indices.size();
        fit["key"] = HexBytes(region.fit->key);
        fit["summary"] = session_json::SummaryJson(region.fit->summary);
        return fit;
      });
      entry["fit"] = part.entry;
      // Whether it is up to date: the key itself may change with the program.
      entry["fit"]["current"] = region.fit->key == snapshot.regions.FitKey(i, snapshot.job);
    }
    list.push_back(std::move(entry));
  }
  monitor.Step("save", 1, 1);
  return list;
}

Json SessionWriter::Impl::Manifest(Run& run, const SessionSnapshot& snapshot,
                                   const fs::path& folder, Monitor& monitor) {
  using session_json::PathJson;
  Json splat = PathJson(snapshot.splat, folder);
  const FileChecksum checksum = snapshot.checksum.get();
  splat["bytes"] = checksum.bytes;
  splat["xxh64"] = HexText(checksum.xxh64);
  splat["gaussians"] = snapshot.gaussians;
  splat["sh_degree"] = snapshot.sh_degree;
  Json view = Json::object();
  if (!snapshot.view.empty()) {
    view = Json::parse(snapshot.view, nullptr, false);
    CheckOption(view.is_object(), "the viewer's part of a session is not a JSON object");
  }
  std::map<const void*, size_t> index_of;
  Json selections = Selections(run, snapshot, &index_of, monitor);
  Json regions = Regions(run, snapshot, index_of, monitor);
  Json draft;
  if (snapshot.draft &&
      !(snapshot.draft->painted.empty() && snapshot.draft->cloud.points.empty())) {
    draft = Require(run, snapshot.draft, "draft-", "", [&](const fs::path& path) {
              Json entry = {{"folder", path.filename().string()}};
              WriteSource(path, *snapshot.draft, &entry, monitor);
              return entry;
            }).entry;
  }
  Json views;
  if (snapshot.views) {
    views = Require(run, snapshot.views, "views-", "", [&](const fs::path& path) {
              WriteReconstructionBinary(path, *snapshot.views);
              Json entry = {{"folder", path.filename().string()}};
              for (const char* file : session_json::kViewFiles) entry[file] = FileJson(path / file);
              return entry;
            }).entry;
  }
  const auto path_or_null = [&](const fs::path& path) {
    return path.empty() ? Json(nullptr) : PathJson(path, folder);
  };
  const Json ocio = IsFile(snapshot.space.config) ? PathJson(snapshot.space.config, folder)
                                                  : Json(snapshot.space.config);
  return {{"format", session_json::kFormat},
          {"version", kSessionVersion},
          {"written_by", Version()},
          {"saved", path_or_null(snapshot.saved)},
          {"workspace", path_or_null(snapshot.workspace)},
          {"images", path_or_null(snapshot.image_folder)},
          {"model", snapshot.model},
          {"world_from_splat", session_json::SimilarityJson(snapshot.world_from_splat)},
          {"render_model",
           snapshot.render_model ? Json(NameOf(*snapshot.render_model)) : Json(nullptr)},
          {"space", snapshot.space.name},
          {"ocio", ocio},
          {"views", views},
          {"splat", splat},
          {"holdout", snapshot.holdout},
          {"background", snapshot.background},
          {"refit", session_json::JobJson(snapshot.job)},
          {"regions", regions},
          {"selections", selections},
          {"draft", draft},
          {"view", view}};
}

SessionSnapshot TakeSnapshot(const EditSession& session) {
  if (!session.scene().splat_checksum().valid()) {
    throw InputError("a scene that was not read from files cannot be saved as a session");
  }
  SessionSnapshot snapshot;
  snapshot.views = session.scene().placed_views();
  if (!snapshot.views) {
    snapshot.workspace = fs::absolute(session.scene().workspace().root).lexically_normal();
  }
  snapshot.model = session.scene().options().model;
  snapshot.world_from_splat = session.scene().options().world_from_splat;
  snapshot.render_model = session.scene().options().render_model;
  snapshot.space = session.scene().options().space;
  if (IsFile(snapshot.space.config)) {
    snapshot.space.config = fs::absolute(snapshot.space.config).lexically_normal().string();
  }
  if (!session.scene().options().image_folder.empty()) {
    snapshot.image_folder = fs::absolute(session.scene().options().image_folder).lexically_normal();
  }
  snapshot.splat = session.scene().splat_path();
  snapshot.checksum = session.scene().splat_checksum();
  snapshot.gaussians = session.scene().original().NumGaussians();
  snapshot.sh_degree = session.scene().original().sh_degree;
  snapshot.holdout = session.scene().options().holdout;
  snapshot.background = session.scene().options().background;
  snapshot.regions = session.store().regions();
  snapshot.job = session.store().job();
  return snapshot;
}

SessionWriter::SessionWriter(fs::path folder)
    : folder_(fs::absolute(folder).lexically_normal()), impl_(std::make_unique<Impl>()) {
  if (!folder_.has_filename()) folder_ = folder_.parent_path();  // "NAME.retint/"
}

SessionWriter::~SessionWriter() = default;

void SessionWriter::CheckFolder() const {
  std::error_code code;
  if (!IsFile(folder_ / session_json::kManifest) && fs::exists(folder_, code) &&
      !(IsFolder(folder_) && fs::is_empty(folder_, code) && !code)) {
    throw RunError(folder_.string() + ": cannot write a session: something else has this name");
  }
}

void SessionWriter::Write(const SessionSnapshot& snapshot, Monitor& monitor) {
  CheckFolder();
  std::error_code code;
  const bool exists = IsFile(folder_ / session_json::kManifest);
  // Another program has saved it since: its parts may have the names of ours.
  if (exists && ReadFile(folder_ / session_json::kManifest) != impl_->manifest) {
    impl_->written.clear();
  }
  InputGuard own;  // a session is saved over itself
  own.Allow(folder_ / session_json::kManifest);
  Impl::Run run;
  // A new session appears under its name when it is whole.
  std::optional<HiddenFolder> hidden;
  if (!exists) {
    fs::create_directories(folder_.parent_path(), code);
    if (code) {
      throw RunError(folder_.string() + ": cannot create its folder: " + code.message());
    }
    hidden.emplace(folder_.parent_path());
    if (hidden->path().empty()) {
      throw RunError(folder_.string() + ": cannot write: " + std::strerror(errno));
    }
  }
  run.root = exists ? folder_ : hidden->path();
  try {
    impl_->manifest = impl_->Manifest(run, snapshot, folder_, monitor).dump(1, ' ', false) + "\n";
    if (!run.fresh.empty()) Sync(run.root);
    WriteFile(run.root / session_json::kManifest, impl_->manifest);
  } catch (const RunError& error) {
    // The hidden name is of no use to anybody.
    std::string message = error.what();
    const size_t at = exists ? std::string::npos : message.find(run.root.string());
    if (at != std::string::npos) message.replace(at, run.root.string().size(), folder_.string());
    throw RunError(message);
  }
  if (!exists) {
    fs::rename(run.root, folder_, code);
    if (code) throw RunError(folder_.string() + ": cannot write: " + code.message());
    hidden->Keep();
  }
  parts_written_ = static_cast<int>(run.fresh.size());
  for (Scratch& part : run.fresh) part.Keep();
  RemoveUnused(folder_, run.names());
  impl_->written = std::move(run.parts);
}

}  // namespace retint
