// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/nerfstudio.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include <Eigen/Dense>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "base/option_name.h"
#include "base/ply_body.h"
#include "base/ply_header.h"
#include "colmap_io/sparse_codec.h"

namespace retint {
namespace {

using Json = nlohmann::json;
using Path = std::filesystem::path;

constexpr double kMostSkew = 1e-3;  // of a rotation's columns, from unit and orthogonal

Json ReadJson(const Path& path) {
  const std::string text = ReadFile(path);
  constexpr size_t kMostBytes = size_t{256} << 20;
  if (text.size() > kMostBytes) throw InputError(path, "is too large for a file of cameras");
  int deepest = 0;
  const auto watch = [&](int depth, Json::parse_event_t, Json&) {
    deepest = std::max(deepest, depth);
    if (deepest > 32) throw InputError(path, "is nested too deeply");
    return true;
  };
  Json json = Json::parse(text, watch, /*allow_exceptions=*/false);
  if (!json.is_object()) throw InputError(path, "is not a JSON object, or truncated");
  return json;
}

std::optional<double> NumberIn(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number()) return std::nullopt;
  const double value = found->get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

void Flatten(const Json& json, std::vector<double>& values) {
  if (json.is_number()) {
    values.push_back(json.get<double>());
  } else if (json.is_array() && values.size() <= 16) {
    for (const Json& one : json) Flatten(one, values);
  }
}

// A 3x4 or 4x4 matrix by rows; nullopt for anything else.
std::optional<Eigen::Matrix4d> MatrixFrom(const std::vector<double>& values) {
  if (values.size() != 12 && values.size() != 16) return std::nullopt;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) return std::nullopt;
    matrix(Eigen::Index(i / 4), Eigen::Index(i % 4)) = values[i];
  }
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).norm() > 1e-9) return std::nullopt;
  return matrix;
}

std::optional<Eigen::Matrix4d> MatrixIn(const Json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end()) return std::nullopt;
  std::vector<double> values;
  Flatten(*found, values);
  return MatrixFrom(values);
}

std::optional<Sim3d> SimilarityFrom(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const double determinant = linear.determinant();
  if (!(determinant > 0)) return std::nullopt;
  Sim3d similarity;
  similarity.scale = std::cbrt(determinant);
  const Eigen::Matrix3d rotation = linear / similarity.scale;
  if (!((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() < kMostSkew)) {
    return std::nullopt;
  }
  similarity.rotation = Eigen::Quaterniond(rotation).normalized();
  similarity.translation = matrix.topRightCorner<3, 1>();
  return similarity;
}

// nerfstudio's name of the camera model; without one, its own default. instant-ngp's files have
// is_fisheye.
std::string ModelOf(const Json& frame, const Json& all) {
  for (const Json* json : {&frame, &all}) {
    const auto model = json->find("camera_model");
    if (model != json->end() && model->is_string()) return model->get<std::string>();
    const auto fisheye = json->find("is_fisheye");
    if (fisheye != json->end() && *fisheye == true) return "OPENCV_FISHEYE";
  }
  return "OPENCV";
}

// `number(key)` is of the frame or of all of the file. `camera` is a pinhole camera as yet.
template <typename Number>
void Bend(const std::string& model, const Number& number, const Path& path, Camera* camera) {
  constexpr std::string_view kPerspective[] = {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL",
                                               "RADIAL", "OPENCV"};
  const auto add = [&](CameraModelId id, std::initializer_list<const char*> keys) {
    camera->model = id;
    for (const char* key : keys) camera->params.push_back(number(key).value_or(0));
  };
  const auto is_set = [&](const char* key) { return number(key).value_or(0) != 0; };
  if (model == "OPENCV_FISHEYE") {
    return add(CameraModelId::kOpenCVFisheye, {"k1", "k2", "k3", "k4"});
  }
  if (model == "FULL_OPENCV") {
    return add(CameraModelId::kFullOpenCV, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"});
  }
  if (std::find(std::begin(kPerspective), std::end(kPerspective), model) ==
      std::end(kPerspective)) {
    throw InputError(path, "camera_model " + model +
                               " is not supported; supported: OPENCV and the simpler ones, "
                               "FULL_OPENCV, OPENCV_FISHEYE and EQUIRECTANGULAR");
  }
  if (is_set("k4")) {
    throw InputError(path, "k4 of camera_model " + model +
                               ", of the eighth power of the radius, is not supported");
  }
  if (is_set("k3")) {
    add(CameraModelId::kFullOpenCV, {"k1", "k2", "p1", "p2", "k3"});
    camera->params.resize(12, 0);
  } else if (is_set("k1") || is_set("k2") || is_set("p1") || is_set("p2")) {
    add(CameraModelId::kOpenCV, {"k1", "k2", "p1", "p2"});
  }
}

Camera CameraFrom(const Json& frame, const Json& all, const Path& path) {
  const auto number = [&](const char* key) {
    const auto own = NumberIn(frame, key);
    return own ? own : NumberIn(all, key);
  };
  const std::string model = ModelOf(frame, all);
  const bool is_sphere = model == "EQUIRECTANGULAR";
  const auto width = number("w"), height = number("h");
  auto fx = number("fl_x"), fy = number("fl_y");
  if (width && !fx) {
    if (const auto angle = number("camera_angle_x")) fx = *width / 2 / std::tan(*angle / 2);
  }
  if (!fy) fy = fx;
  const bool has_focal = is_sphere || (fx && *fx > 0 && *fy > 0);
  if (!width || !height || !has_focal || !(*width >= 1) || !(*height >= 1) || *width > 1e6 ||
      *height > 1e6) {
    throw InputError(path, "has no usable w, h and fl_x (or camera_angle_x) for each frame");
  }
  if (is_sphere) {  // the whole of it, whatever fl_x says
    const int w = int(*width), h = int(*height);
    return {0, CameraModelId::kEquirectangular, w, h, {double(w), double(h)}};
  }
  const double cx = number("cx").value_or(*width / 2), cy = number("cy").value_or(*height / 2);
  Camera camera = Camera::Pinhole(0, int(*width), int(*height), *fx, *fy, cx, cy);
  Bend(model, number, path, &camera);
  return camera;
}

// Its file_path, without parts that lead out of the folder: names of views are those of files that
// are written, too.
std::string NameOf(const Json& frame, const Path& path) {
  const auto found = frame.find("file_path");
  if (found == frame.end() || !found->is_string()) {
    throw InputError(path, "has a frame without file_path");
  }
  auto file = found->get<std::string>();
  std::replace(file.begin(), file.end(), '\\', '/');  // of Windows
  Path relative;
  for (const Path& part : Path(file).lexically_normal().relative_path()) {
    if (part != "..") relative /= part;
  }
  const std::string name = relative.generic_string();
  if (name.empty() || name == ".") throw InputError(path, "has a frame without file_path");
  return name;
}

// The next row. Colors are bytes or, as floats, of [0, 1].
SparsePoint PointFrom(const PlyElement& element, PlyBody& body, const Path& ply, PointId id) {
  static constexpr std::string_view kPlaces[] = {"x", "y", "z"},
                                    kColors[] = {"red", "green", "blue"};
  SparsePoint point;
  point.id = id;
  int places = 0;
  for (const PlyProperty& property : element.properties) {
    const PlyColumn column = ColumnOf(property);
    const auto place = std::find(std::begin(kPlaces), std::end(kPlaces), property.name);
    const auto color = std::find(std::begin(kColors), std::end(kColors), property.name);
    if (column.list_count || (place == std::end(kPlaces) && color == std::end(kColors))) {
      body.Skip(column);
      continue;
    }
    const double value = body.Value(column.type);
    if (place != std::end(kPlaces)) {
      point.xyz[place - std::begin(kPlaces)] = value;
      ++places;
    } else {
      const bool is_float = column.type == PlyType::kFloat || column.type == PlyType::kDouble;
      const double shown = std::clamp(is_float ? 255 * value : value, 0.0, 255.0);
      point.color[color - std::begin(kColors)] =
          static_cast<uint8_t>(std::isnan(shown) ? 0 : shown);
    }
  }
  if (places != 3) throw InputError(ply, "vertices lack x, y or z");
  if (!point.xyz.allFinite()) {
    throw InputError(ply, "point " + std::to_string(id - 1) + ": position is NaN or infinite");
  }
  return point;
}

// Positions and colors of the .ply that `ply_file_path` names; whatever is wrong with it is a
// warning, for points are not needed.
void ReadPoints(const Json& json, const Path& path, const Sim3d& world_from_data,
                Reconstruction* model, std::vector<std::string>* warnings) {
  const auto named = json.find("ply_file_path");
  try {
    if (!named->is_string()) throw InputError(path, "ply_file_path is not a name");
    const Path ply = path.parent_path() / named->get<std::string>();
    const std::string bytes = ReadFile(ply);
    const PlyHeader header =
        ParsePlyHeader(std::string_view(bytes).substr(0, kMaxPlyHeaderBytes), ply);
    PlyBody body(bytes, header, ply);
    auto element = header.elements.begin();
    while (element != header.elements.end() && element->name != "vertex") body.Skip(*element++);
    if (element == header.elements.end()) throw InputError(ply, "holds no vertices");
    body.Require(*element);
    std::map<PointId, SparsePoint> points;
    for (PointId id = 1; id <= element->count; ++id) {
      const SparsePoint point = PointFrom(*element, body, ply, id);
      points.emplace(id, point).first->second.xyz = world_from_data * point.xyz;
    }
    model->points = std::move(points);
  } catch (const InputError& error) {
    if (warnings)
      warnings->push_back(std::string("the sparse points are left out: ") + error.what());
  }
}

// The file's world from COLMAP's.
Sim3d AppliedTo(const Json& json, const Path& path) {
  Sim3d applied;
  if (json.contains("applied_transform")) {
    const auto matrix = MatrixIn(json, "applied_transform");
    const auto similarity = matrix ? SimilarityFrom(*matrix) : std::nullopt;
    if (!similarity) throw InputError(path, "applied_transform is not a similarity");
    applied = *similarity;
  }
  const double scale = NumberIn(json, "applied_scale").value_or(1);
  if (!(scale > 0)) throw InputError(path, "applied_scale is not positive");
  applied.scale *= scale;
  applied.translation *= scale;
  return applied;
}

}  // namespace

Reconstruction ReadTransforms(const Path& path, std::vector<std::string>* warnings) {
  const Json json = ReadJson(path);
  const auto frames = json.find("frames");
  if (frames == json.end() || !frames->is_array() || frames->empty()) {
    throw InputError(path, "has no frames: it is not nerfstudio's file of cameras");
  }
  const Sim3d data_from_world = AppliedTo(json, path);
  const Sim3d world_from_data = data_from_world.Inverse();
  // x right, y up, z backward to x right, y down, z forward.
  const Eigen::Quaterniond turn(0, 1, 0, 0);
  Reconstruction model;
  std::set<std::string> names;
  sparse_codec::LeftOut left_out;
  for (const Json& frame : *frames) {
    if (!frame.is_object()) throw InputError(path, "has a frame that is not an object");
    const auto matrix = MatrixIn(frame, "transform_matrix");
    const auto pose = matrix ? SimilarityFrom(*matrix) : std::nullopt;
    View view;
    view.name = NameOf(frame, path);
    if (!pose) {
      left_out.Add(InputError(path, view.name + ": transform_matrix is not a pose").what());
      continue;
    }
    Camera camera = CameraFrom(frame, json, path);
    const auto same = std::find_if(model.cameras.begin(), model.cameras.end(), [&](const auto& c) {
      camera.id = c.first;
      return c.second == camera;
    });
    if (same == model.cameras.end()) {
      camera.id = static_cast<CameraId>(model.cameras.size() + 1);
      model.cameras.emplace(camera.id, camera);
    }
    view.camera_id = camera.id;
    Rigid3d world_from_cam;
    world_from_cam.rotation = (world_from_data.rotation * pose->rotation * turn).normalized();
    world_from_cam.translation = world_from_data * pose->translation;
    view.cam_from_world = world_from_cam.Inverse();
    view.id = static_cast<ViewId>(model.views.size() + 1);
    if (!names.insert(view.name).second)
      throw InputError(path, "two frames are named " + view.name);
    model.views.emplace(view.id, std::move(view));
  }
  sparse_codec::Warnings told;
  left_out.Tell(path, model.views.size(), told);
  if (warnings) warnings->insert(warnings->end(), told.begin(), told.end());
  if (json.contains("ply_file_path")) ReadPoints(json, path, world_from_data, &model, warnings);
  if (model.points.empty() && warnings) {
    warnings->push_back(path.string() + ": has no sparse points");
  }
  return model;
}

Sim3d ReadWorldFromSplat(const Path& path) {
  const Json json = ReadJson(path);
  if (const auto matrix = MatrixIn(json, "world_from_splat")) {
    if (const auto similarity = SimilarityFrom(*matrix)) return *similarity;
    throw InputError(path, "world_from_splat is not a similarity (rotation, scale, translation)");
  }
  const auto matrix = MatrixIn(json, "transform");
  const auto scale = NumberIn(json, "scale");
  if (!matrix || !scale || !(*scale > 0)) {
    throw InputError(path,
                     "holds neither world_from_splat, a 3x4 or 4x4 matrix, nor transform and scale "
                     "as nerfstudio's dataparser_transforms.json does");
  }
  auto splat_from_world = SimilarityFrom(*matrix);
  if (!splat_from_world) throw InputError(path, "transform is not a similarity");
  splat_from_world->scale *= *scale;
  splat_from_world->translation *= *scale;
  return splat_from_world->Inverse();
}

// With a decimal point wherever the program runs: a window takes over the locale of its user.
Sim3d ParseWorldFromSplat(const std::string& text) {
  std::vector<double> values;
  const char *at = text.data(), *const end = at + text.size();
  while (at < end) {
    if (std::string_view(" ,;\n\t").find(*at) != std::string_view::npos) {
      ++at;
      continue;
    }
    double value = 0;
    const bool has_plus = *at == '+' && at + 1 < end && at[1] != '-';
    const auto [next, error] = std::from_chars(has_plus ? at + 1 : at, end, value);
    if (error != std::errc()) break;
    values.push_back(value);
    at = next;
  }
  const auto matrix = at == end ? MatrixFrom(values) : std::nullopt;
  const auto similarity = matrix ? SimilarityFrom(*matrix) : std::nullopt;
  CheckOption(
      similarity.has_value(),
      OptionName("world_from_splat") + ": '" + text +
          "' is neither a file nor the 12 or 16 numbers, by rows, of a matrix that rotates, "
          "scales and moves");
  return *similarity;
}

Sim3d WorldFromSplatOf(const std::string& text) {
  return IsFile(text) ? ReadWorldFromSplat(text) : ParseWorldFromSplat(text);
}

bool IsIdentity(const Sim3d& similarity) {
  return similarity.scale == 1 && similarity.rotation.w() == 1 && similarity.translation.isZero(0);
}

std::string WorldFromSplatToText(const Sim3d& world_from_splat) {
  const Eigen::Matrix3d linear =
      world_from_splat.scale * world_from_splat.rotation.toRotationMatrix();
  std::string text;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c) {
      char number[32];  // of 24 characters at most
      const double value = c < 3 ? linear(r, c) : world_from_splat.translation[r];
      const char* const end = std::to_chars(number, number + sizeof number, value).ptr;
      if (!text.empty()) text += ' ';
      text += std::string_view(number, end);
    }
  }
  return text;
}

std::string WorldFromSplatToJson(const Sim3d& world_from_splat) {
  const Eigen::Matrix3d linear =
      world_from_splat.scale * world_from_splat.rotation.toRotationMatrix();
  Json rows = Json::array();
  for (int r = 0; r < 3; ++r) {
    rows.push_back({linear(r, 0), linear(r, 1), linear(r, 2), world_from_splat.translation[r]});
  }
  rows.push_back({0, 0, 0, 1});
  return Json{{"world_from_splat", rows}}.dump(1) + "\n";
}

}  // namespace retint
