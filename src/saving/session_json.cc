// SPDX-License-Identifier: BSD-3-Clause
#include "saving/session_json.h"

#include <algorithm>

#include "base/files.h"
#include "base/option_json.h"
#include "base/unique_keys.h"
#include "colmap_io/nerfstudio.h"
#include "recolor/edit_text.h"

namespace retint::session_json {

using json::OptionsJson;
using json::ReadOptions;

namespace fs = std::filesystem;

Json ReadManifest(const fs::path& folder) {
  if (!IsFolder(folder)) throw InputError(folder, "is not a session: no such folder");
  const fs::path path = folder / kManifest;
  if (!IsFile(path)) {
    throw InputError(folder, std::string("is not a session: it holds no ") + kManifest);
  }
  const std::string text = ReadFile(path);
  Json json;
  try {
    json = ParseWithUniqueKeys<Json>(text);
  } catch (const OptionError& error) {
    throw InputError(path, error.what());
  } catch (const nlohmann::json::parse_error& error) {
    throw InputError(path, "is not JSON, or cut off, at byte " + std::to_string(error.byte));
  } catch (const nlohmann::json::exception&) {
    throw InputError(path, "holds a number that is out of range");
  }
  const Node root(json, path, "");
  if (!json.is_object() || !json.contains("format") || json["format"] != kFormat) {
    throw InputError(path, std::string("is not a session: its \"format\" is not ") + kFormat);
  }
  const uint64_t version = root.At("version").Unsigned();
  if (version < 1 || version > kSessionVersion) {
    throw InputError(path, "is of version " + std::to_string(version) +
                               " of the format; this program reads versions 1 to " +
                               std::to_string(kSessionVersion) +
                               (version > kSessionVersion ? ": a newer one is needed" : ""));
  }
  return json;
}

namespace {

// Version 1 had one number for all solvers; 0 stood for the solver's default.
bool HasOldDefault(const Node& node) {
  return node.Has("iterations") &&
         node.At("iterations").Int(0, std::numeric_limits<int>::max()) == 0;
}

constexpr const char* kOldCache = "region_cache_bytes";  // before region_cache_mb

}  // namespace

Json SelectionJson(SelectOptions select, ProjectorOptions projector) {
  OptionList list;
  select.Describe(list);
  projector.Describe(list);
  return OptionsJson(AllSettings(list));
}

void ReadSelection(const Node& node, SelectOptions* select, ProjectorOptions* projector) {
  OptionList list;
  select->Describe(list);
  projector->Describe(list);
  ReadOptions(node, list);
  try {
    select->Check();
    projector->Check();
  } catch (const OptionError& error) {
    node.Fail(error.what());
  }
}

Json JobJson(const RefitJob& job) { return OptionsJson(AllSettings(Described(job))); }

RefitJob ReadJob(const Node& node) {
  RefitJob job;
  OptionList list;
  job.Describe(list);
  ReadOptions(node, list);
  if (HasOldDefault(node)) {
    job.options.mm.iterations = MmOptions().iterations;
    job.options.adam.iterations = AdamOptions().iterations;
  }
  if (node.Has(kOldCache)) job.options.SetRegionCacheBytes(node.At(kOldCache).Unsigned());
  try {
    job.Check();
  } catch (const OptionError& error) {
    node.Fail(error.what());
  }
  return job;
}

Json EditJson(const Region& region) {
  return {{"id", region.id},
          {"name", EscapeBytes(region.name)},
          {"visible", region.visible},
          {"strength", region.strength},
          {"edit", Json::parse(EditToJson(region.edit, /*with_tables=*/true))}};
}

namespace {

// Before edits were lists: one affine map.
ColorEdit ReadAffineEdit(const Node& node) {
  const std::vector<Node> gain = node.At("gain").List(9), offset = node.At("offset").List(3);
  AffineColor map;
  for (int i = 0; i < 9; ++i) map.gain(i / 3, i % 3) = gain[size_t(i)].Float();
  for (int i = 0; i < 3; ++i) map.offset(i) = offset[size_t(i)].Float();
  const bool is_tint = map.gain.isDiagonal(0) && map.offset.isZero(0);
  return is_tint ? ColorEdit::Tint(map.gain.diagonal()) : ColorEdit::FromAffine(map);
}

}  // namespace

void ReadEdit(const Node& node, Region* region) {
  region->id = static_cast<RegionId>(
      node.At("id").Unsigned(std::numeric_limits<RegionId>::max() - 1));  // the next one exists
  if (region->id == 0) node.At("id").Fail("is 0");
  region->name = node.At("name").Bytes();
  region->visible = node.At("visible").Bool();
  region->strength = node.At("strength").Float();
  if (region->strength < 0 || region->strength > 1) {
    node.At("strength").Fail("is not between 0 and 1");
  }
  const Node edit = node.Has("gain") ? node : node.At("edit");
  try {
    region->edit = node.Has("gain") ? ReadAffineEdit(node)
                                    : EditFromJson(edit.json().dump(), node.path().parent_path());
    region->edit.Check();
    CheckOption(!region->edit.NeedsMainColor(),
                "its colors were not measured: \"from\" is missing");
  } catch (const OptionError& error) {
    edit.Fail(error.what());
  }
}

Json SimilarityJson(const Sim3d& similarity) {
  const Eigen::Quaterniond& q = similarity.rotation;
  const Eigen::Vector3d& t = similarity.translation;
  if (IsIdentity(similarity)) return nullptr;
  return {similarity.scale, q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

Sim3d ReadSimilarity(const Node& node) {
  Sim3d similarity;
  if (node.IsNull()) return similarity;
  std::vector<double> values;
  for (const Node& value : node.List(8)) values.push_back(value.Number());
  similarity.scale = values[0];
  similarity.rotation = Eigen::Quaterniond(values[1], values[2], values[3], values[4]);
  similarity.translation = {values[5], values[6], values[7]};
  const double norm = similarity.rotation.norm();
  if (!(similarity.scale > 0) || !(norm > 1e-6)) node.Fail("is not a similarity");
  similarity.rotation.normalize();
  return similarity;
}

Json CameraJson(const PosedCamera& view) {
  const Rigid3d& pose = view.cam_from_world;
  const Eigen::Quaterniond& q = pose.rotation;
  return {{"id", view.camera.id},
          {"model", static_cast<int>(view.camera.model)},
          {"width", view.camera.width},
          {"height", view.camera.height},
          {"params", view.camera.params},
          {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"translation", {pose.translation.x(), pose.translation.y(), pose.translation.z()}}};
}

PosedCamera ReadCamera(const Node& node) {
  constexpr int kMostPixels = 65535;
  PosedCamera view;
  Camera& camera = view.camera;
  camera.id = static_cast<CameraId>(node.At("id").Unsigned(std::numeric_limits<CameraId>::max()));
  const CameraModelInfo* info = FindCameraModel(node.At("model").Int(-1, 1000));
  if (!info) node.At("model").Fail("is not known");
  camera.model = info->id;
  camera.width = node.At("width").Int(1, kMostPixels);
  camera.height = node.At("height").Int(1, kMostPixels);
  const Node params = node.At("params");
  for (const Node& value : params.List(static_cast<size_t>(info->num_params))) {
    camera.params.push_back(value.Number());
  }
  if (camera.IsPinhole() && (camera.fx() <= 0 || camera.fy() <= 0)) {
    params.Fail("focal length is not positive");
  }
  const std::vector<Node> q = node.At("rotation_wxyz").List(4);
  view.cam_from_world.rotation =
      Eigen::Quaterniond(q[0].Number(), q[1].Number(), q[2].Number(), q[3].Number());
  const double norm = view.cam_from_world.rotation.norm();
  if (!(std::abs(norm - 1) < 1e-6)) node.At("rotation_wxyz").Fail("is not of unit length");
  const std::vector<Node> t = node.At("translation").List(3);
  for (size_t i = 0; i < 3; ++i) {
    view.cam_from_world.translation[Eigen::Index(i)] = t[i].Number();
  }
  return view;
}

namespace {

Json Finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

double FiniteOrNone(const Node& node) {
  return node.IsNull() ? std::numeric_limits<double>::quiet_NaN() : node.Number();
}

}  // namespace

Json ReportJson(const PaintedReport& report) {
  const RegistrationSummary& moved = report.registration;
  const Sim3d& sim = moved.world_from_cloud;
  return {{"view", EscapeBytes(report.view)},
          {"outlined_by", EscapeBytes(report.outlined_by)},
          {"depth_method", report.depth_method},
          {"depth_reason", EscapeBytes(report.depth_reason)},
          {"valid_fraction", Finite(report.valid_fraction)},
          {"mask_pixels", report.cloud.mask_pixels},
          {"sampled", report.cloud.sampled},
          {"kept", report.cloud.kept},
          {"points_used", moved.points_used},
          {"points_heldout", moved.points_heldout},
          {"rms_before", Finite(moved.rms_before)},
          {"rms_after", Finite(moved.rms_after)},
          {"heldout_before", Finite(moved.heldout_before)},
          {"heldout_after", Finite(moved.heldout_after)},
          {"a", Finite(moved.a)},
          {"b", Finite(moved.b)},
          {"scale", Finite(sim.scale)},
          {"rotation_wxyz",
           {Finite(sim.rotation.w()), Finite(sim.rotation.x()), Finite(sim.rotation.y()),
            Finite(sim.rotation.z())}},
          {"translation",
           {Finite(sim.translation.x()), Finite(sim.translation.y()), Finite(sim.translation.z())}},
          {"accepted", moved.accepted},
          {"reason", EscapeBytes(moved.reason)}};
}

PaintedReport ReadReport(const Node& node) {
  constexpr int kMost = std::numeric_limits<int>::max();
  PaintedReport report;
  RegistrationSummary& moved = report.registration;
  const auto number = [&](const char* key) { return FiniteOrNone(node.At(key)); };
  report.view = node.At("view").Bytes();
  if (node.Has("outlined_by")) report.outlined_by = node.At("outlined_by").Bytes();
  report.depth_method = node.At("depth_method").Text();
  report.depth_reason = node.At("depth_reason").Bytes();
  report.valid_fraction = number("valid_fraction");
  report.cloud.mask_pixels = node.At("mask_pixels").Int(0, kMost);
  report.cloud.sampled = node.At("sampled").Int(0, kMost);
  report.cloud.kept = node.At("kept").Int(0, kMost);
  moved.points_used = node.At("points_used").Int(0, kMost);
  moved.points_heldout = node.At("points_heldout").Int(0, kMost);
  moved.rms_before = number("rms_before");
  moved.rms_after = number("rms_after");
  moved.heldout_before = number("heldout_before");
  moved.heldout_after = number("heldout_after");
  moved.a = number("a");
  moved.b = number("b");
  Sim3d& sim = moved.world_from_cloud;
  sim.scale = number("scale");
  const std::vector<Node> q = node.At("rotation_wxyz").List(4);
  sim.rotation = Eigen::Quaterniond(FiniteOrNone(q[0]), FiniteOrNone(q[1]), FiniteOrNone(q[2]),
                                    FiniteOrNone(q[3]));
  const std::vector<Node> t = node.At("translation").List(3);
  for (size_t i = 0; i < 3; ++i) sim.translation[Eigen::Index(i)] = FiniteOrNone(t[i]);
  moved.accepted = node.At("accepted").Bool();
  moved.reason = node.At("reason").Bytes();
  return report;
}

Json SummaryJson(const RefitSummary& summary) {
  Json losses = Json::array();
  // A step that diverged has no loss: null.
  for (const double loss : summary.losses) {
    losses.push_back(std::isfinite(loss) ? Json(loss) : Json(nullptr));
  }
  return {{"solver", summary.solver},
          {"iterations", summary.iterations},
          {"active_gaussians", summary.active_gaussians},
          {"changed_gaussians", summary.changed_gaussians},
          {"views", summary.views},
          {"views_kept", summary.views_kept},
          {"region_bytes", summary.region_bytes},
          {"region_fraction", std::isfinite(summary.region_fraction) ? summary.region_fraction : 0},
          {"converged", summary.converged},
          {"losses", losses},
          {"reason", summary.reason}};
}

RefitSummary ReadSummary(const Node& node) {
  constexpr int kMost = std::numeric_limits<int>::max();
  RefitSummary summary;
  summary.solver = node.At("solver").Text();
  summary.iterations = node.At("iterations").Int(0, kMost);
  summary.active_gaussians = node.At("active_gaussians").Int(0, kMost);
  summary.changed_gaussians = node.At("changed_gaussians").Int(0, kMost);
  summary.views = node.At("views").Int(0, kMost);
  summary.views_kept = node.At("views_kept").Int(0, kMost);
  summary.region_bytes = node.At("region_bytes").Unsigned();
  summary.region_fraction = node.At("region_fraction").Number();
  summary.converged = node.At("converged").Bool();
  for (const Node& loss : node.At("losses").List()) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    summary.losses.push_back(loss.IsNull() ? kNone : loss.Number());
  }
  summary.reason = node.At("reason").Text();
  return summary;
}

Json PathJson(const fs::path& path, const fs::path& folder) {
  const fs::path from = fs::absolute(folder).lexically_normal().parent_path();
  return {{"relative", EscapeBytes(path.lexically_relative(from).generic_string())},
          {"absolute", EscapeBytes(path.generic_string())}};
}

std::vector<fs::path> ReadPaths(const Node& node, const fs::path& folder) {
  const fs::path from = fs::absolute(folder).lexically_normal().parent_path();
  const std::string relative = node.At("relative").Bytes(), absolute = node.At("absolute").Bytes();
  std::vector<fs::path> paths;
  for (const fs::path& path :
       {relative.empty() ? fs::path() : (from / relative).lexically_normal(), fs::path(absolute)}) {
    const bool bad = path.native().find('\0') != std::string::npos;
    if (!path.empty() && !bad && (paths.empty() || paths[0] != path)) paths.push_back(path);
  }
  if (paths.empty()) node.Fail("is empty");
  return paths;
}

}  // namespace retint::session_json
