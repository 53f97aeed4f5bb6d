// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <charconv>

#include "colmap_io/sparse_codec.h"
#include "colmap_io/sparse_fields.h"

namespace retint::sparse_codec {
namespace {

void ReadObservations(std::string_view line, const Lines& lines, View& view) {
  Fields fields(line, lines);
  while (!fields.AtEnd()) {
    Observation observation;
    observation.xy.x() = fields.Number("POINTS2D X");
    observation.xy.y() = fields.Number("POINTS2D Y");
    const std::string_view word = fields.Word("POINTS2D POINT3D_ID");
    if (word != "-1") observation.point_id = Fields(word, lines).Integer<PointId>("POINT3D_ID");
    view.observations.push_back(observation);
  }
}

// All but the id.
void ReadCamera(Fields& fields, Camera& camera) {
  const std::string label = "camera " + std::to_string(camera.id);
  const std::string_view name = fields.Word("MODEL");
  const CameraModelInfo* info = FindCameraModel(name);
  if (info == nullptr) {
    fields.FailRecord(label + " has unknown model \"" + std::string(name) + "\"");
  }
  camera.model = info->id;
  const auto width = fields.Integer<uint64_t>("WIDTH");
  const auto height = fields.Integer<uint64_t>("HEIGHT");
  while (!fields.AtEnd()) camera.params.push_back(fields.Number("PARAMS"));
  if (camera.params.size() != static_cast<size_t>(info->num_params)) {
    fields.Fail(label + ": " + std::string(name) + " takes " + std::to_string(info->num_params) +
                " parameters, not " + std::to_string(camera.params.size()));
  }
  const std::string fault = CameraFault(camera, width, height);
  if (!fault.empty()) fields.FailRecord(label + ": " + fault);
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
}

SparsePoint ReadPoint(Fields& fields) {
  SparsePoint point;
  point.id = fields.Integer<PointId>("POINT3D_ID");
  point.xyz.x() = fields.Number("X");
  point.xyz.y() = fields.Number("Y");
  point.xyz.z() = fields.Number("Z");
  constexpr const char* kColors[] = {"R", "G", "B"};
  for (int k = 0; k < 3; ++k) point.color[k] = fields.Integer<uint8_t>(kColors[k]);
  point.error = fields.Number("ERROR");
  while (!fields.AtEnd()) {
    TrackElement element;
    element.view_id = fields.Integer<ViewId>("TRACK IMAGE_ID");
    element.observation_idx = fields.Integer<uint32_t>("TRACK POINT2D_IDX");
    point.track.push_back(element);
  }
  return point;
}

void AppendInteger(std::string& out, uint64_t value) { out += std::to_string(value); }

// As std::ostream with precision 17 and as printf's %.17g, in every locale.
void AppendNumber(std::string& out, double value) {
  char buffer[40];
  const auto end =
      std::to_chars(buffer, buffer + sizeof(buffer), value, std::chars_format::general, 17);
  out.append(buffer, end.ptr);
}

}  // namespace

BadCameras ReadCamerasText(std::string_view bytes, const Path& path, Warnings& warnings,
                           Reconstruction& model) {
  Lines lines(bytes, path);
  BadCameras bad;
  size_t records = 0;
  for (; const auto line = lines.NextRecord(); ++records) {
    Fields fields(*line, lines);
    Camera camera;
    camera.id = fields.Integer<CameraId>("CAMERA_ID");
    try {
      ReadCamera(fields, camera);
    } catch (const BadRecord& fault) {
      bad.emplace(camera.id, fault.what());
      continue;
    }
    if (!model.cameras.emplace(camera.id, camera).second) {
      fields.Fail("camera " + std::to_string(camera.id) + " twice");
    }
  }
  lines.WarnIfFewer(records, warnings);
  return bad;
}

void ReadImagesText(std::string_view bytes, const Path& path, Warnings& warnings,
                    Reconstruction& model) {
  Lines lines(bytes, path);
  LeftOut left_out;
  size_t records = 0;
  for (; const auto line = lines.NextRecord(); ++records) {
    Fields fields(*line, lines);
    View view;
    view.id = fields.Integer<ViewId>("IMAGE_ID");
    const std::string label = "image " + std::to_string(view.id);
    bool sound = left_out.IsSound([&] {
      view.cam_from_world = ReadPose(fields, label);
      view.camera_id = fields.Integer<CameraId>("CAMERA_ID");
      // The rest of the line: names may hold blanks.
      view.name = fields.Rest("NAME");
    });
    if (model.views.count(view.id) > 0) fields.Fail(label + " twice");
    // The second line is always there and may be empty; only at the end of the file may it be
    // missing.
    if (const auto points = lines.Next(); points && sound) {
      sound = left_out.IsSound([&] { ReadObservations(*points, lines, view); });
    }
    const ViewId id = view.id;
    if (sound) model.views.emplace(id, std::move(view));
  }
  lines.WarnIfFewer(records, warnings);
  left_out.Tell(path, model.views.size(), warnings);
}

void ReadPointsText(std::string_view bytes, const Path& path, Warnings& warnings,
                    Reconstruction& model) {
  Lines lines(bytes, path);
  LeftOut left_out;
  size_t records = 0;
  for (; const auto line = lines.NextRecord(); ++records) {
    Fields fields(*line, lines);
    SparsePoint point;
    const bool sound = left_out.IsSound([&] { point = ReadPoint(fields); });
    const PointId id = point.id;
    if (sound && !model.points.emplace(id, std::move(point)).second) {
      fields.Fail("point " + std::to_string(id) + " twice");
    }
  }
  lines.WarnIfFewer(records, warnings);
  left_out.Tell(path, model.points.size(), warnings);
}

std::string CamerasToText(const Reconstruction& model) {
  std::string out =
      "# Camera list with one line of data per camera:\n"
      "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
      "# Number of cameras: " +
      std::to_string(model.cameras.size()) + "\n";
  for (const auto& [id, camera] : model.cameras) {
    AppendInteger(out, id);
    (out += ' ') += FindCameraModel(static_cast<int>(camera.model))->name;
    (out += ' ') += std::to_string(camera.width);
    (out += ' ') += std::to_string(camera.height);
    for (const double param : camera.params) AppendNumber(out += ' ', param);
    out += '\n';
  }
  return out;
}

std::string ImagesToText(const Reconstruction& model) {
  size_t observed = 0;
  for (const auto& [id, view] : model.views) {
    observed += static_cast<size_t>(
        std::count_if(view.observations.begin(), view.observations.end(),
                      [](const Observation& o) { return o.point_id != kInvalidPointId; }));
  }
  std::string out =
      "# Image list with two lines of data per image:\n"
      "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   POINTS2D[] as (X, Y, POINT3D_ID)\n"
      "# Number of images: " +
      std::to_string(model.views.size()) + ", mean observations per image: ";
  AppendNumber(out, model.views.empty()
                        ? 0
                        : static_cast<double>(observed) / static_cast<double>(model.views.size()));
  out += '\n';
  for (const auto& [id, view] : model.views) {
    const Rigid3d& pose = view.cam_from_world;
    AppendInteger(out, id);
    for (const double value :
         {pose.rotation.w(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z(),
          pose.translation.x(), pose.translation.y(), pose.translation.z()}) {
      AppendNumber(out += ' ', value);
    }
    AppendInteger(out += ' ', view.camera_id);
    ((out += ' ') += view.name) += '\n';
    const char* separator = "";
    for (const Observation& observation : view.observations) {
      AppendNumber(out += separator, observation.xy.x());
      AppendNumber(out += ' ', observation.xy.y());
      out += ' ';
      if (observation.point_id == kInvalidPointId) {
        out += "-1";
      } else {
        AppendInteger(out, observation.point_id);
      }
      separator = " ";
    }
    out += '\n';
  }
  return out;
}

std::string PointsToText(const Reconstruction& model) {
  size_t elements = 0;
  for (const auto& [id, point] : model.points) elements += point.track.size();
  std::string out =
      "# 3D point list with one line of data per point:\n"
      "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
      "# Number of points: " +
      std::to_string(model.points.size()) + ", mean track length: ";
  AppendNumber(out, model.points.empty()
                        ? 0
                        : static_cast<double>(elements) / static_cast<double>(model.points.size()));
  out += '\n';
  for (const auto& [id, point] : model.points) {
    AppendInteger(out, id);
    for (int k = 0; k < 3; ++k) AppendNumber(out += ' ', point.xyz[k]);
    for (int k = 0; k < 3; ++k) AppendInteger(out += ' ', point.color[k]);
    AppendNumber(out += ' ', point.error);
    if (point.track.empty()) out += ' ';  // as COLMAP's writer leaves it
    for (const TrackElement& element : point.track) {
      AppendInteger(out += ' ', element.view_id);
      AppendInteger(out += ' ', element.observation_idx);
    }
    out += '\n';
  }
  return out;
}

}  // namespace retint::sparse_codec
