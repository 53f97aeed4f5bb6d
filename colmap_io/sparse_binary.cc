// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstring>

#include "base/files.h"
#include "colmap_io/sparse_codec.h"

namespace retint::sparse_codec {
namespace {

// The least that one record takes in its file, for checking counts before taking memory.
constexpr uint64_t kMinCameraBytes = 4 + 4 + 8 + 8;
constexpr uint64_t kMinImageBytes = 4 + 7 * 8 + 4 + 1 + 8;
constexpr uint64_t kMinPointBytes = 8 + 3 * 8 + 3 + 8 + 8;
constexpr uint64_t kObservationBytes = 8 + 8 + 8;
constexpr uint64_t kTrackElementBytes = 4 + 4;

template <typename T>
void Append(std::string& out, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string At(uint64_t offset, const std::string& fault) {
  return fault + " (byte " + std::to_string(offset) + ")";
}

[[noreturn]] void Fail(const ByteReader& reader, uint64_t offset, const std::string& fault) {
  throw InputError(reader.Path(), At(offset, fault));
}

// One record, which is read to its end even where a value is bad.
class Record {
 public:
  explicit Record(ByteReader& reader) : reader_(reader), offset_(reader.Offset()) {}
  // "image 7", which is all that tells one record from another to people.
  void Name(const std::string& name) { name_ = name; }
  double Finite(const char* what) {
    const uint64_t offset = reader_.Offset();
    const double value = reader_.Read<double>(what);
    if (!std::isfinite(value)) {
      Add(offset, name_ + ": " + what + (std::isnan(value) ? " is NaN" : " is infinite"));
    }
    return value;
  }
  void Add(const std::string& fault) { Add(offset_, fault); }
  void Add(uint64_t offset, const std::string& fault) {
    if (fault_.empty()) fault_ = InputError(reader_.Path(), At(offset, fault)).what();
  }
  // The first; empty where it is sound.
  const std::string& fault() const { return fault_; }

 private:
  ByteReader& reader_;
  const uint64_t offset_;
  std::string name_, fault_;
};

std::string ReadName(ByteReader& reader, std::string_view bytes, ViewId id) {
  const size_t end = bytes.find('\0', reader.Offset());
  if (end == std::string_view::npos) {
    throw InputError(reader.Path(),
                     "truncated: the name of image " + std::to_string(id) + " has no end");
  }
  std::string name(reader.ReadBytes(end - reader.Offset(), "name"));
  reader.ReadBytes(1, "name");
  return name;
}

void ReadObservations(ByteReader& reader, View& view, Record& record) {
  const auto count = reader.Read<uint64_t>("observation count");
  reader.Require(count, kObservationBytes, "observations of image " + std::to_string(view.id));
  const uint64_t offset = reader.Offset();
  const std::string_view records = reader.ReadBytes(count * kObservationBytes, "observations");
  view.observations.resize(count);
  for (uint64_t i = 0; i < count; ++i) {
    const char* bytes = records.data() + i * kObservationBytes;
    Observation& observation = view.observations[i];
    std::memcpy(observation.xy.data(), bytes, 2 * sizeof(double));
    std::memcpy(&observation.point_id, bytes + 2 * sizeof(double), sizeof(PointId));
    if (!observation.xy.allFinite()) {
      record.Add(offset + i * kObservationBytes, "image " + std::to_string(view.id) +
                                                     ": observation " + std::to_string(i) +
                                                     " is not finite");
    }
  }
}

void WarnOfRest(const ByteReader& reader, Warnings& warnings) {
  if (reader.Remaining() > 0) {
    warnings.push_back(reader.Path().string() + ": " + std::to_string(reader.Remaining()) +
                       " bytes after the last record are ignored");
  }
}

}  // namespace

BadCameras ReadCamerasBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                             Reconstruction& model) {
  ByteReader reader(bytes, path);
  const auto count = reader.Read<uint64_t>("camera count");
  reader.Require(count, kMinCameraBytes, "cameras");
  BadCameras bad;
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t offset = reader.Offset();
    Record record(reader);
    Camera camera;
    camera.id = reader.Read<uint32_t>("camera id");
    const std::string label = "camera " + std::to_string(camera.id);
    record.Name(label);
    const auto model_id = reader.Read<int32_t>("camera model");
    const CameraModelInfo* info = FindCameraModel(model_id);
    if (info == nullptr) {
      Fail(reader, offset, label + " has unknown model id " + std::to_string(model_id));
    }
    camera.model = info->id;
    const auto width = reader.Read<uint64_t>("camera width");
    const auto height = reader.Read<uint64_t>("camera height");
    for (int p = 0; p < info->num_params; ++p) {
      camera.params.push_back(record.Finite("camera parameter"));
    }
    const std::string fault = CameraFault(camera, width, height);
    if (!fault.empty()) record.Add(label + ": " + fault);
    if (!record.fault().empty()) {
      bad.emplace(camera.id, record.fault());
      continue;
    }
    camera.width = static_cast<int>(width);
    camera.height = static_cast<int>(height);
    if (!model.cameras.emplace(camera.id, camera).second) Fail(reader, offset, label + " twice");
  }
  WarnOfRest(reader, warnings);
  return bad;
}

void ReadImagesBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                      Reconstruction& model) {
  ByteReader reader(bytes, path);
  const auto count = reader.Read<uint64_t>("image count");
  reader.Require(count, kMinImageBytes, "images");
  LeftOut left_out;
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t offset = reader.Offset();
    Record record(reader);
    View view;
    view.id = reader.Read<uint32_t>("image id");
    const std::string label = "image " + std::to_string(view.id);
    record.Name(label);
    Rigid3d& pose = view.cam_from_world;
    for (double* value :
         {&pose.rotation.w(), &pose.rotation.x(), &pose.rotation.y(), &pose.rotation.z()}) {
      *value = record.Finite("rotation");
    }
    for (int k = 0; k < 3; ++k) pose.translation[k] = record.Finite("translation");
    if (!NormalizeRotation(pose.rotation)) record.Add(label + " has a zero rotation");
    view.camera_id = reader.Read<uint32_t>("camera id");
    view.name = ReadName(reader, bytes, view.id);
    if (view.name.empty()) Fail(reader, offset, label + " has no name");
    ReadObservations(reader, view, record);
    if (!record.fault().empty()) {
      left_out.Add(record.fault());
      continue;
    }
    const ViewId id = view.id;
    if (!model.views.emplace(id, std::move(view)).second) Fail(reader, offset, label + " twice");
  }
  WarnOfRest(reader, warnings);
  left_out.Tell(path, model.views.size(), warnings);
}

void ReadPointsBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                      Reconstruction& model) {
  ByteReader reader(bytes, path);
  const auto count = reader.Read<uint64_t>("point count");
  reader.Require(count, kMinPointBytes, "points");
  LeftOut left_out;
  for (uint64_t i = 0; i < count; ++i) {
    const uint64_t offset = reader.Offset();
    Record record(reader);
    SparsePoint point;
    point.id = reader.Read<uint64_t>("point id");
    record.Name("point " + std::to_string(point.id));
    for (int k = 0; k < 3; ++k) point.xyz[k] = record.Finite("point coordinate");
    for (int k = 0; k < 3; ++k) point.color[k] = reader.Read<uint8_t>("point color");
    point.error = record.Finite("point error");
    const auto length = reader.Read<uint64_t>("track length");
    reader.Require(length, kTrackElementBytes,
                   "track elements of point " + std::to_string(point.id));
    point.track.resize(length);
    for (TrackElement& element : point.track) {
      element.view_id = reader.Read<uint32_t>("track");
      element.observation_idx = reader.Read<uint32_t>("track");
    }
    if (!record.fault().empty()) {
      left_out.Add(record.fault());
      continue;
    }
    const PointId id = point.id;
    if (!model.points.emplace(id, std::move(point)).second) {
      Fail(reader, offset, "point " + std::to_string(id) + " twice");
    }
  }
  WarnOfRest(reader, warnings);
  left_out.Tell(path, model.points.size(), warnings);
}

std::string CamerasToBinary(const Reconstruction& model) {
  std::string out;
  Append(out, uint64_t{model.cameras.size()});
  for (const auto& [id, camera] : model.cameras) {
    Append(out, id);
    Append(out, static_cast<int32_t>(camera.model));
    Append(out, static_cast<uint64_t>(camera.width));
    Append(out, static_cast<uint64_t>(camera.height));
    for (const double param : camera.params) Append(out, param);
  }
  return out;
}

std::string ImagesToBinary(const Reconstruction& model) {
  std::string out;
  Append(out, uint64_t{model.views.size()});
  for (const auto& [id, view] : model.views) {
    const Rigid3d& pose = view.cam_from_world;
    Append(out, id);
    for (const double value :
         {pose.rotation.w(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z(),
          pose.translation.x(), pose.translation.y(), pose.translation.z()}) {
      Append(out, value);
    }
    Append(out, view.camera_id);
    out.append(view.name.c_str(), view.name.size() + 1);
    Append(out, uint64_t{view.observations.size()});
    for (const Observation& observation : view.observations) {
      Append(out, observation.xy.x());
      Append(out, observation.xy.y());
      Append(out, observation.point_id);
    }
  }
  return out;
}

std::string PointsToBinary(const Reconstruction& model) {
  std::string out;
  Append(out, uint64_t{model.points.size()});
  for (const auto& [id, point] : model.points) {
    Append(out, id);
    for (int k = 0; k < 3; ++k) Append(out, point.xyz[k]);
    for (int k = 0; k < 3; ++k) Append(out, point.color[k]);
    Append(out, point.error);
    Append(out, uint64_t{point.track.size()});
    for (const TrackElement& element : point.track) {
      Append(out, element.view_id);
      Append(out, element.observation_idx);
    }
  }
  return out;
}

}  // namespace retint::sparse_codec
