// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/stage_keys.h"

#include "base/run_clock.h"
#include "depth/network_matcher.h"
#include "editing/compare_pictures.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

void AddSum(StageKey& key, const FileChecksum& sum) {
  key.AddValue(sum.bytes);
  key.AddValue(sum.xxh64);
}

}  // namespace

std::string SceneKey(const OpenScene& scene) {
  StageKey key("scene");
  key.Add(Version());
  key.Add(scene.backend().Name());
  AddSum(key, scene.splat_checksum().get());
  AddTraits(key, scene.original().traits);
  const Reconstruction& model = scene.reconstruction();
  for (const View* view : model.ViewsByName()) {
    const Camera& camera = model.cameras.at(view->camera_id);
    key.Add(view->name);
    key.AddValue(camera.model);
    key.AddValue(camera.width);
    key.AddValue(camera.height);
    for (const double value : camera.params) key.AddValue(value);
    for (const double value : view->cam_from_world.rotation.coeffs()) key.AddValue(value);
    for (const double value : view->cam_from_world.translation) key.AddValue(value);
    for (const Observation& observation : view->observations) {
      if (observation.point_id == kInvalidPointId) continue;
      key.AddValue(observation.point_id);
      for (const double value : observation.xy) key.AddValue(value);
    }
  }
  for (const auto& [id, point] : model.points) {
    key.AddValue(id);
    for (const double value : point.xyz) key.AddValue(value);
  }
  return key.Hex();
}

void AddMasks(StageKey& key, const std::map<std::string, Mask>& masks) {
  for (const auto& [name, mask] : masks) {
    key.Add(name);
    key.AddValue(mask.width);
    key.Add({reinterpret_cast<const char*>(mask.data.data()), mask.data.size()});
  }
}

void AddNetwork(StageKey& key, const SelectOptions& options) {
  const StereoHvOptions& stereo = options.depth.stereo_hv;
  const bool matches = stereo.matcher == StereoMatcherKind::kNetwork;
  if (matches && options.depth_method == "stereo-hv") key.Add(NetworkOf(stereo)->Identity());
}

void AddFile(StageKey& key, const fs::path& file) { AddSum(key, ChecksumFile(file)); }

void AddPictures(StageKey& key, const ColorEdit& edit, const Workspace& workspace) {
  for (const ColorOperation& op : edit.operations) {
    for (const fs::path& file : FilesCompared(op, workspace)) AddFile(key, file);
  }
}

}  // namespace retint
