// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/synthetic_workspace.h"

#include <algorithm>
#include <utility>

#include "base/files.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "colmap_io/sparse.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

Mask ObjectMask(const SyntheticView& view, int object) {
  Mask mask(view.object_ids.width, view.object_ids.height);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    mask.data[i] = view.object_ids.data[i] == object ? 255 : 0;
  }
  return mask;
}

// The view that sees most of the box, and sees it whole; the box is pale and shows a tint well. If
// there is none, the same of any object; in tiny pictures, not whole either.
SyntheticStart ChooseStart(const SyntheticScene& scene) {
  SyntheticStart start;
  std::pair<int, int64_t> best = {-1, 0};
  for (const int object : scene.still_life) {
    const std::string& name = scene.object_names[size_t(object)];
    const std::vector<int>& whole = scene.whole_views[size_t(object)];
    for (size_t v = 0; v < scene.views.size(); ++v) {
      const auto& ids = scene.views[v].object_ids.data;
      const bool is_whole = std::find(whole.begin(), whole.end(), int(v)) != whole.end();
      const std::pair value(is_whole ? 1 + (name == "box") : 0,
                            int64_t(std::count(ids.begin(), ids.end(), uint8_t(object))));
      if (value <= best) continue;
      best = value;
      start = {name, scene.views[v].name, ViewFile("masks", scene.views[v].name)};
    }
  }
  return start;
}

}  // namespace

SyntheticStart WriteSyntheticWorkspace(const std::filesystem::path& folder,
                                       const SyntheticScene& scene, Monitor& monitor) {
  const SyntheticStart start = ChooseStart(scene);
  WriteReconstructionBinary(folder / "sparse" / "0", scene.reconstruction);
  WriteSplat(folder / "splat.ply", scene.model);
  std::string names;
  for (size_t o = 0; o < scene.object_names.size(); ++o) {
    names += std::to_string(o) + " " + scene.object_names[o] + "\n";
  }
  WriteFile(folder / "truth" / "objects.txt", names);
  for (size_t v = 0; v < scene.views.size(); ++v) {
    monitor.Step("save", static_cast<double>(v), static_cast<double>(scene.views.size()));
    const SyntheticView& view = scene.views[v];
    WritePng(folder / "images" / view.name, view.photo);
    WriteDepthMap(ViewFile(folder / "truth" / "depth", view.name, ".bin"), view.depth);
    WritePng(ViewFile(folder / "truth" / "objects", view.name), view.object_ids);
    for (const int object : scene.still_life) {
      const std::string& name = scene.object_names[static_cast<size_t>(object)];
      const Mask mask = ObjectMask(view, object);
      WritePng(ViewFile(folder / "truth" / "masks" / name, view.name), mask);
      if (name == start.object && view.name == start.view) WritePng(folder / start.mask, mask);
    }
  }
  monitor.Step("save", 1, 1);
  return start;
}

}  // namespace retint
