// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/synthetic_workspace.h"

#include <algorithm>
#include <string_view>

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

int64_t CountPixels(const SyntheticView& view, int object) {
  return std::count(view.object_ids.data.begin(), view.object_ids.data.end(),
                    static_cast<uint8_t>(object));
}

// What the brush mask paints where a view sees it whole: pale, it shows a tint well.
constexpr std::string_view kSubject = "box";

// The view that sees most of the subject, and it whole; where none does, of any object; in tiny
// pictures, not whole either.
SyntheticStart ChooseStart(const SyntheticScene& scene) {
  enum class Wanted { kSubjectWhole, kAnyWhole, kAny };
  SyntheticStart start;
  int64_t most = 0;
  for (const Wanted wanted : {Wanted::kSubjectWhole, Wanted::kAnyWhole, Wanted::kAny}) {
    for (const int object : scene.still_life) {
      const auto o = static_cast<size_t>(object);
      if (wanted == Wanted::kSubjectWhole && scene.object_names[o] != kSubject) continue;
      for (size_t v = 0; v < scene.views.size(); ++v) {
        const auto& seen = scene.whole_views[o];
        const bool whole = std::find(seen.begin(), seen.end(), static_cast<int>(v)) != seen.end();
        if (wanted != Wanted::kAny && !whole) continue;
        const int64_t count = CountPixels(scene.views[v], object);
        if (count <= most && !start.view.empty()) continue;
        most = count;
        start.object = scene.object_names[o];
        start.view = scene.views[v].name;
      }
    }
    if (most > 0) break;
  }
  start.mask = ViewFile("masks", start.view);
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
