// SPDX-License-Identifier: BSD-3-Clause
// rigs.bin and frames.bin of COLMAP 3.12 and newer (src/colmap/scene/reconstruction_io_binary.cc),
// for models that lack images.bin.
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/sparse_codec.h"

namespace retint::sparse_codec {
namespace {

constexpr int32_t kCamera = 0;  // of the kinds of sensors

using SensorId = std::pair<int32_t, uint32_t>;  // kind, id
// sensor_from_rig; nullopt where the file does not know it.
using Rig = std::map<SensorId, std::optional<Rigid3d>>;

Rigid3d ReadPose(ByteReader& reader, const std::string& whose) {
  double values[7];
  for (double& value : values) {
    value = reader.Read<double>("pose");
    if (!std::isfinite(value)) throw InputError(reader.Path(), whose + ": its pose is not finite");
  }
  Rigid3d pose;
  pose.rotation = Eigen::Quaterniond(values[0], values[1], values[2], values[3]);
  if (!NormalizeRotation(pose.rotation)) {
    throw InputError(reader.Path(), whose + ": its rotation has no direction");
  }
  pose.translation = {values[4], values[5], values[6]};
  return pose;
}

SensorId ReadSensor(ByteReader& reader) {
  const auto kind = reader.Read<int32_t>("sensor");
  return {kind, reader.Read<uint32_t>("sensor")};
}

std::map<uint32_t, Rig> ReadRigs(const Path& path) {
  const std::string bytes = ReadFile(path);
  ByteReader reader(bytes, path);
  const auto count = reader.Read<uint64_t>("number of rigs");
  reader.Require(count, 8, "rigs");
  std::map<uint32_t, Rig> rigs;
  for (uint64_t i = 0; i < count; ++i) {
    const auto id = reader.Read<uint32_t>("rig");
    const auto sensors = reader.Read<uint32_t>("rig");
    Rig rig;
    if (sensors > 0) rig[ReadSensor(reader)] = Rigid3d();
    for (uint32_t s = 1; s < sensors; ++s) {
      const SensorId sensor = ReadSensor(reader);
      const bool known = reader.Read<uint8_t>("sensor") != 0;
      rig[sensor] =
          known ? std::optional(ReadPose(reader, "rig " + std::to_string(id))) : std::nullopt;
    }
    if (!rigs.emplace(id, std::move(rig)).second) {
      throw InputError(path, "rig " + std::to_string(id) + " comes twice");
    }
  }
  return rigs;
}

std::string NameOf(ViewId id) {
  char name[32];
  std::snprintf(name, sizeof(name), "image_%05u", id);
  return name;
}

}  // namespace

void ReadFramesBinary(const Path& folder, Warnings& warnings, Reconstruction& model) {
  const Path path = folder / "frames.bin";
  const std::map<uint32_t, Rig> rigs = ReadRigs(folder / "rigs.bin");
  const std::string bytes = ReadFile(path);
  ByteReader reader(bytes, path);
  const auto count = reader.Read<uint64_t>("number of frames");
  reader.Require(count, 68, "frames");
  size_t without_pose = 0;
  for (uint64_t i = 0; i < count; ++i) {
    const auto id = reader.Read<uint32_t>("frame");
    const auto rig = rigs.find(reader.Read<uint32_t>("frame"));
    const Rigid3d rig_from_world = ReadPose(reader, "frame " + std::to_string(id));
    const auto images = reader.Read<uint32_t>("frame");
    reader.Require(images, 16, "images of a frame");
    for (uint32_t k = 0; k < images; ++k) {
      const SensorId sensor = ReadSensor(reader);
      const auto image = reader.Read<uint64_t>("image of a frame");
      if (sensor.first != kCamera) continue;
      if (image > UINT32_MAX - 1) throw InputError(path, "an image's id is out of range");
      const auto known = rig == rigs.end() ? Rig::const_iterator() : rig->second.find(sensor);
      if (rig == rigs.end() || known == rig->second.end() || !known->second) {
        ++without_pose;
        continue;
      }
      View view;
      view.id = static_cast<ViewId>(image);
      view.name = NameOf(view.id);
      view.camera_id = sensor.second;
      view.cam_from_world = *known->second * rig_from_world;
      if (!model.views.emplace(view.id, view).second) {
        throw InputError(path, "image " + std::to_string(image) + " comes twice");
      }
    }
  }
  if (without_pose > 0) {
    warnings.push_back(path.string() + ": left out " + std::to_string(without_pose) +
                       " images of cameras whose place in their rig is unknown");
  }
  warnings.push_back((folder / "images.bin").string() +
                     ": is missing; poses come from frames.bin, views are named by their ids (" +
                     NameOf(1) + " and on), and photos are not found");
}

}  // namespace retint::sparse_codec
