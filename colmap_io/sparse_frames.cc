// SPDX-License-Identifier: BSD-3-Clause
// rigs.* and frames.* of COLMAP 3.12 and newer, binary or text (COLMAP doc/format.rst and
// src/colmap/scene/reconstruction_io_*.cc), for models that lack images.*.
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/sparse_codec.h"
#include "colmap_io/sparse_fields.h"

namespace retint::sparse_codec {
namespace {

constexpr int32_t kCamera = 0, kOtherSensor = -1;  // of the kinds of sensors

using SensorId = std::pair<int32_t, uint32_t>;  // kind, id
// sensor_from_rig; nullopt where the file does not know it.
using Rig = std::map<SensorId, std::optional<Rigid3d>>;
using Rigs = std::map<uint32_t, Rig>;

// One moment of a rig, and the images (or other data) that its sensors took.
struct Frame {
  uint32_t rig = 0;
  Rigid3d rig_from_world;
  std::vector<std::pair<SensorId, uint64_t>> data;
};

void Add(Rigs& rigs, uint32_t id, Rig rig, const Path& path) {
  if (rigs.emplace(id, std::move(rig)).second) return;
  throw InputError(path, "rig " + std::to_string(id) + " comes twice");
}

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

SensorId ReadSensor(Fields& fields) {
  const int32_t kind = fields.Word("SENSOR_TYPE") == "CAMERA" ? kCamera : kOtherSensor;
  return {kind, fields.Integer<uint32_t>("SENSOR_ID")};
}

Rigs ReadRigsBinary(std::string_view bytes, const Path& path) {
  ByteReader reader(bytes, path);
  const auto count = reader.Read<uint64_t>("number of rigs");
  reader.Require(count, 8, "rigs");
  Rigs rigs;
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
    Add(rigs, id, std::move(rig), path);
  }
  return rigs;
}

Rigs ReadRigsText(std::string_view bytes, const Path& path, Warnings& warnings) {
  Lines lines(bytes, path);
  Rigs rigs;
  while (const auto line = lines.NextRecord()) {
    Fields fields(*line, lines);
    const auto id = fields.Integer<uint32_t>("RIG_ID");
    const auto sensors = fields.Integer<uint32_t>("NUM_SENSORS");
    Rig rig;
    if (sensors > 0) rig[ReadSensor(fields)] = Rigid3d();
    for (uint32_t s = 1; s < sensors; ++s) {
      const SensorId sensor = ReadSensor(fields);
      const bool known = fields.Integer<int>("HAS_POSE") != 0;
      rig[sensor] =
          known ? std::optional(ReadPose(fields, "rig " + std::to_string(id))) : std::nullopt;
    }
    Add(rigs, id, std::move(rig), path);
  }
  lines.WarnIfFewer(rigs.size(), warnings);
  return rigs;
}

std::vector<Frame> ReadFramesBinary(std::string_view bytes, const Path& path) {
  ByteReader reader(bytes, path);
  const auto count = reader.Read<uint64_t>("number of frames");
  reader.Require(count, 68, "frames");
  std::vector<Frame> frames;
  for (uint64_t i = 0; i < count; ++i) {
    const auto id = reader.Read<uint32_t>("frame");
    Frame frame;
    frame.rig = reader.Read<uint32_t>("frame");
    frame.rig_from_world = ReadPose(reader, "frame " + std::to_string(id));
    const auto images = reader.Read<uint32_t>("frame");
    reader.Require(images, 16, "images of a frame");
    for (uint32_t k = 0; k < images; ++k) {
      const SensorId sensor = ReadSensor(reader);
      frame.data.emplace_back(sensor, reader.Read<uint64_t>("image of a frame"));
    }
    frames.push_back(std::move(frame));
  }
  return frames;
}

std::vector<Frame> ReadFramesText(std::string_view bytes, const Path& path, Warnings& warnings) {
  Lines lines(bytes, path);
  std::vector<Frame> frames;
  while (const auto line = lines.NextRecord()) {
    Fields fields(*line, lines);
    const auto id = fields.Integer<uint32_t>("FRAME_ID");
    Frame frame;
    frame.rig = fields.Integer<uint32_t>("RIG_ID");
    frame.rig_from_world = ReadPose(fields, "frame " + std::to_string(id));
    const auto images = fields.Integer<uint32_t>("NUM_DATA_IDS");
    for (uint32_t k = 0; k < images; ++k) {
      const SensorId sensor = ReadSensor(fields);
      frame.data.emplace_back(sensor, fields.Integer<uint64_t>("DATA_ID"));
    }
    frames.push_back(std::move(frame));
  }
  lines.WarnIfFewer(frames.size(), warnings);
  return frames;
}

std::string NameOf(ViewId id) {
  char name[32];
  std::snprintf(name, sizeof(name), "image_%05u", id);
  return name;
}

// A view for every image of a camera whose place in its rig is known; how many were left out.
size_t AddViews(const Rigs& rigs, const std::vector<Frame>& frames, const Path& path,
                Reconstruction& model) {
  size_t without_pose = 0;
  for (const Frame& frame : frames) {
    const auto rig = rigs.find(frame.rig);
    for (const auto& [sensor, image] : frame.data) {
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
      view.cam_from_world = *known->second * frame.rig_from_world;
      if (!model.views.emplace(view.id, view).second) {
        throw InputError(path, "image " + std::to_string(image) + " comes twice");
      }
    }
  }
  return without_pose;
}

}  // namespace

void ReadRigsAndFrames(const Path& rigs, const Path& frames, Warnings& warnings,
                       Reconstruction& model) {
  const auto is_binary = [](const Path& path) { return path.extension() == ".bin"; };
  const std::string rig_bytes = ReadFile(rigs), frame_bytes = ReadFile(frames);
  const size_t left_out = AddViews(
      is_binary(rigs) ? ReadRigsBinary(rig_bytes, rigs) : ReadRigsText(rig_bytes, rigs, warnings),
      is_binary(frames) ? ReadFramesBinary(frame_bytes, frames)
                        : ReadFramesText(frame_bytes, frames, warnings),
      frames, model);
  if (left_out > 0) {
    warnings.push_back(frames.string() + ": left out " + std::to_string(left_out) +
                       " images of cameras whose place in their rig is unknown");
  }
  const Path images = frames.parent_path() / ("images" + frames.extension().string());
  warnings.push_back(images.string() + ": is missing; poses come from " +
                     frames.filename().string() + ", views are named by their ids (" + NameOf(1) +
                     " and on), and photos are not found");
}

}  // namespace retint::sparse_codec
