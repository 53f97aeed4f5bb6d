// SPDX-License-Identifier: BSD-3-Clause
#include "base/files.h"
#include "pipeline/job_file.h"
#include "recolor/edit_text.h"
#include "recolor/lut.h"
#include "saving/session_file.h"
#include "selecting/selection_files.h"
#include "selection/selection_cloud.h"
#include "tests/fuzz/targets.h"
#include "tests/saving/saved_scene.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr size_t kShares = 5;

std::map<std::string, Mask> SmallMasks() { return {{"a.png", Mask(4, 3, 255)}}; }

SelectionCloud SmallCloud() {
  SelectionCloud cloud;
  cloud.sources = {"a.png", "b %.png"};
  cloud.points.resize(6);
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    cloud.points[i].position = Eigen::Vector3f(0.1F, 0.2F, 0.3F) * static_cast<float>(i);
    cloud.points[i].source = static_cast<uint16_t>(i % 2);
  }
  return cloud;
}

std::vector<std::string> CloudSeeds() {
  const TempFolder folder;
  WriteCloud(folder / "a.ply", SmallCloud());
  return {ReadFile(folder / "a.ply"),
          "ply\nformat ascii 1.0\nelement other 1\nproperty list uchar int i\nelement vertex 2\n"
          "property double x\nproperty double y\nproperty double z\nproperty uchar red\n"
          "end_header\n2 7 8\n1 2 3 200\n4 5 6 100"};
}

std::vector<std::string> LutSeeds() {
  std::string cube = "TITLE \"seed\"\nLUT_3D_SIZE 2\nDOMAIN_MIN 0 0 0\nDOMAIN_MAX 1 1 1\n";
  for (int i = 0; i < 8; ++i) {
    cube += std::to_string(i & 1) + " " + std::to_string(i >> 1 & 1) + " 0.5\n";
  }
  return {cube, "LUT_1D_SIZE 3\n0 0 0\n0.5 0.4 0.3\n1 1 1\n", std::string(118, '6') + "\n"};
}

std::vector<std::string> EditSeeds() {
  return {R"({"operations": [{"op": "recolor", "to": "#3060ff", "keep_lightness": 0.2},
{"op": "exposure", "stops": 0.5, "strength": 0.8}, {"op": "gradient", "stops": [[0, 1, 0, 0],
[1, 0, 0, 1]]}, {"op": "matrix", "rows": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0]}, {"op": "palette",
"colors": [{"from": "#ff0000", "to": "#00ff00"}]}]})",
          R"({"operations": [{"op": "lut", "size": 2, "table": "AAAAAAAAAAAAAAAA"}]})"};
}

std::vector<std::string> JobSeeds() {
  return {R"({"workspace": "ws", "splat": "s.ply", "seed": 3, "holdout": 8, "regions": [{"name":
"a", "paint": [{"view": "a.png", "mask": "m.png"}], "edit": {"operations": [{"op": "gray"}]}}],
"outputs": {"splat": "out.ply", "report": "r.json"}})"};
}

std::vector<std::string> ShareSeeds() {
  const TempFolder folder;
  WriteShares(folder.path(), SmallMasks(), std::vector<float>(kShares, 0.5F), {});
  return {ReadFile(folder / "shares.bin")};
}

// A saved session beside its scene.
void PrepareSession(const fs::path& folder) {
  const TinyScene scene(21);
  WriteTinyScene(scene, folder);
  const auto session = OpenTinyScene(folder);
  EditTinyScene(scene, *session);
  Monitor monitor;
  SessionWriter(folder / "s.retint").Write(TakeSnapshot(*session), monitor);
}

std::vector<std::string> SessionSeeds() {
  const TempFolder folder;
  PrepareSession(folder.path());
  return {ReadFile(folder / "s.retint/session.json")};
}

void ReadSession(const fs::path& folder) {
  ReadSessionInfo(folder / "s.retint");
  SessionOptions options;
  options.backend = "cpu";
  Monitor monitor;
  OpenSession(folder / "s.retint", options, monitor);
}

}  // namespace

std::span<const FuzzTarget> SessionTargets() {
  static const FuzzTarget targets[] = {
      {"cloud",
       "a.ply",
       [](const fs::path& f) { ReadCloud(f / "a.ply"); },
       nullptr,
       CloudSeeds,
       {"splats/test-splat.3-points-from-train.ply"}},
      {"lut", "a.cube", [](const fs::path& f) { ReadLut(f / "a.cube"); }, nullptr, LutSeeds, {}},
      {"edit", "e.json", [](const fs::path& f) { ReadEdit(f / "e.json"); }, nullptr, EditSeeds, {}},
      {"job", "j.json", [](const fs::path& f) { ReadJob(f / "j.json"); }, nullptr, JobSeeds, {}},
      {"shares",
       "shares.bin",
       [](const fs::path& f) { ReadShares(f, SmallMasks(), kShares); },
       nullptr,
       ShareSeeds,
       {}},
      {"session", "s.retint/session.json", ReadSession, PrepareSession, SessionSeeds, {}},
  };
  return targets;
}

}  // namespace retint
