// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/gltf_codec.h"

#include <array>
#include <functional>
#include <optional>
#include <unordered_set>

#include <Eigen/Geometry>

#include "base/base64.h"
#include "base/files.h"
#include "base/printable.h"
#include "scene/rigid3d.h"
#include "scene/sh_rotation.h"
#include "splat_io/axes.h"
#include "splat_io/gltf_file.h"
#include "splat_io/parallel_rows.h"
#include "splat_io/placement.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

using Json = nlohmann::json;

constexpr const char* kExtension = "KHR_gaussian_splatting";
constexpr size_t kBlockRows = 8192;
constexpr size_t kRowsRead = 2048;  // of one attribute at a time
constexpr size_t kMostDepth = 256;  // of nodes

std::string Attribute(const std::string& name) { return std::string(kExtension) + ":" + name; }

// The attribute of coefficient k, counted as in GaussianModel.
std::string ShAttribute(int k) {
  const int degree = static_cast<int>(std::sqrt(k + 0.5));
  return Attribute("SH_DEGREE_" + std::to_string(degree) + "_COEF_" +
                   std::to_string(k - degree * degree));
}

// ---- Reading

// A primitive and the transform of its node.
struct Placed {
  const Json* primitive;
  Sim3d world_from_node;
};

class SceneReader {
 public:
  explicit SceneReader(const GltfFile& file) : file_(file) {}

  GaussianModel Read(Monitor& monitor) {
    FindPrimitives();
    uint64_t total = 0;
    int degree = 0;
    for (const Placed& placed : placed_) {
      const uint64_t count = file_.Count(Accessor(*placed.primitive, "POSITION"));
      // Many nodes may show one mesh, but in total it must not exceed the file's length.
      if (count > file_.BufferBytes() / 12 || (total += count) > file_.BufferBytes() / 12) {
        file_.Fail("announces more Gaussians than its " + std::to_string(file_.BufferBytes()) +
                   " bytes can hold");
      }
      degree = std::max(degree, Degree(*placed.primitive));
      degree_4_ = degree_4_ || HasDegree4(*placed.primitive);
    }
    if (total == 0) file_.Fail("holds no Gaussians: no primitive has " + std::string(kExtension));
    model_.Resize(total, degree);
    for (const Placed& placed : placed_) Append(placed, monitor);
    if (degree_4_) {
      model_.source.notes.push_back("spherical harmonics of degree 4 are not used: " +
                                    std::string(kExtension) + " ends at 3");
    }
    if (file_.ignored_bytes() > 0) {
      model_.source.notes.push_back(file_.path().string() + ": " +
                                    std::to_string(file_.ignored_bytes()) +
                                    " bytes after the end of the glTF are ignored");
    }
    if (other_meshes_) model_.source.notes.push_back("meshes other than Gaussians are not used");
    return std::move(model_);
  }

 private:
  void FindPrimitives() {
    const Json& json = file_.json();
    if (!json.contains("scenes")) {
      // Without a scene, every mesh is shown, untransformed.
      const size_t meshes = json.contains("meshes") ? json["meshes"].size() : 0;
      for (size_t m = 0; m < meshes; ++m) AddMesh(m, {});
      return;
    }
    const Json& scene = file_.Item("scenes", file_.Whole(json, "scene", 0));
    for (const uint64_t node : Children(scene, "nodes")) Visit(node, {}, 0);
  }

  std::vector<uint64_t> Children(const Json& object, const char* name) const {
    std::vector<uint64_t> indices;
    const auto found = object.find(name);
    if (found == object.end()) return indices;
    if (found->is_array()) {
      for (const Json& index : *found) {
        if (index.is_number_unsigned()) indices.push_back(index.get<uint64_t>());
      }
    }
    if (!found->is_array() || indices.size() != found->size()) {
      file_.Fail(std::string(name) + " is not a list of indices");
    }
    return indices;
  }

  void Visit(uint64_t index, const Sim3d& world_from_parent, size_t depth) {
    if (depth > kMostDepth || !visited_.insert(index).second) {
      file_.Fail("its nodes are no tree");
    }
    const Json& node = file_.Item("nodes", index);
    const Sim3d parent_from_node = Transform(node, index);
    Sim3d world_from_node;
    world_from_node.scale = world_from_parent.scale * parent_from_node.scale;
    world_from_node.rotation =
        (world_from_parent.rotation * parent_from_node.rotation).normalized();
    world_from_node.translation = world_from_parent * parent_from_node.translation;
    if (node.contains("mesh")) AddMesh(file_.Whole(node, "mesh", 0), world_from_node);
    for (const uint64_t child : Children(node, "children")) {
      Visit(child, world_from_node, depth + 1);
    }
  }

  std::vector<double> Numbers(const Json& object, const char* name,
                              std::vector<double> otherwise) const {
    const auto found = object.find(name);
    if (found == object.end()) return otherwise;
    std::vector<double> numbers;
    if (found->is_array()) {
      for (const Json& value : *found) {
        if (value.is_number()) numbers.push_back(value.get<double>());
      }
    }
    if (numbers.size() != otherwise.size()) {
      file_.Fail(std::string("a node's ") + name + " is not a list of " +
                 std::to_string(otherwise.size()) + " numbers");
    }
    return numbers;
  }

  Sim3d Transform(const Json& node, uint64_t index) const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (node.contains("matrix")) {
      const auto m = Numbers(node, "matrix", std::vector<double>(16));
      matrix = Eigen::Map<const Eigen::Matrix4d>(m.data());  // column-major, as in glTF
    } else {
      const auto t = Numbers(node, "translation", {0, 0, 0});
      const auto r = Numbers(node, "rotation", {0, 0, 0, 1});
      const auto s = Numbers(node, "scale", {1, 1, 1});
      matrix.topLeftCorner<3, 3>() = Eigen::Quaterniond(r[3], r[0], r[1], r[2]).toRotationMatrix() *
                                     Eigen::Vector3d(s[0], s[1], s[2]).asDiagonal();
      matrix.topRightCorner<3, 1>() = Eigen::Vector3d(t[0], t[1], t[2]);
    }
    const std::optional<Sim3d> parent_from_node = SimilarityOf(matrix);
    if (!parent_from_node) {
      file_.Fail("node " + std::to_string(index) +
                 " stretches or mirrors its Gaussians, which is not supported");
    }
    return *parent_from_node;
  }

  void AddMesh(uint64_t index, const Sim3d& world_from_node) {
    const Json& mesh = file_.Item("meshes", index);
    const auto primitives = mesh.find("primitives");
    if (primitives == mesh.end() || !primitives->is_array()) file_.Fail("a mesh has no primitives");
    for (const Json& primitive : *primitives) {
      const Json* extensions = Member(primitive, "extensions");
      const Json* extension = extensions ? Member(*extensions, kExtension) : nullptr;
      if (!extension) {
        other_meshes_ = true;
        continue;
      }
      CheckExtension(*extension);
      placed_.push_back({&primitive, world_from_node});
    }
  }

  void CheckExtension(const Json& extension) {
    if (!extension.is_object()) file_.Fail(std::string(kExtension) + " is not an object");
    const Json* further = Member(extension, "extensions");
    if (further && further->is_object() && !further->empty()) {
      file_.Fail("its Gaussians are stored by " + Printable(further->begin().key().substr(0, 80)) +
                 ", which is not supported");
    }
    const Json* kernel = Member(extension, "kernel");
    const Json* projection = Member(extension, "projection");
    if (projection && !IsText(projection, "perspective")) {
      model_.source.notes.push_back(
          "the Gaussians' projection is not perspective: it is used all the same");
    }
    if (kernel && !IsText(kernel, "ellipse")) {
      file_.Fail("its Gaussians have another kernel than ellipse, which is not supported");
    }
    TakeColorSpace(Member(extension, "colorSpace"));
  }

  // Of each primitive; all need the same one.
  void TakeColorSpace(const Json* name) {
    std::optional<ColorSpace> space = ColorSpace::kSrgbDisplay;
    if (name) space = name->is_string() ? ColorSpaceNamed(name->get<std::string>()) : std::nullopt;
    if (!space) {
      model_.source.notes.push_back("the colors' space is not known, " +
                                    name->dump().substr(0, 80) +
                                    ": they are read as srgb_rec709_display");
      space = ColorSpace::kSrgbDisplay;
    }
    if (!placed_.empty() && *space != model_.traits.color_space) {
      file_.Fail("its Gaussians are in several color spaces, which is not supported");
    }
    model_.traits.color_space = *space;
  }

  uint64_t Accessor(const Json& primitive, const std::string& attribute) const {
    const auto attributes = primitive.find("attributes");
    if (attributes == primitive.end() || !attributes->is_object() ||
        !attributes->contains(attribute)) {
      file_.Fail("a primitive lacks the attribute " + attribute);
    }
    return file_.Whole(*attributes, attribute.c_str(), 0);
  }

  int Degree(const Json& primitive) const {
    const Json* attributes = Member(primitive, "attributes");
    int degree = 0;
    for (int l = 1; l <= 3; ++l) {
      if (attributes && Member(*attributes, ShAttribute(l * l).c_str())) degree = l;
    }
    return degree;
  }

  static bool HasDegree4(const Json& primitive) {
    const Json* attributes = Member(primitive, "attributes");
    return attributes && Member(*attributes, ShAttribute(16).c_str());
  }

  void Append(const Placed& placed, Monitor& monitor) {
    const Json& primitive = *placed.primitive;
    const size_t count = file_.Count(Accessor(primitive, "POSITION"));
    const auto view = [&](const std::string& attribute, int components) {
      const GltfValues values = file_.View(Accessor(primitive, attribute), components);
      if (values.count != count) {
        file_.Fail("the attribute " + attribute + " has not one value a position");
      }
      return values;
    };
    Attributes values{view("POSITION", 3),
                      view(Attribute("ROTATION"), 4),
                      view(Attribute("SCALE"), 3),
                      view(Attribute("OPACITY"), 1),
                      {}};
    const int coefficients = (Degree(primitive) + 1) * (Degree(primitive) + 1);
    for (int k = 0; k < coefficients; ++k) values.sh.push_back(view(ShAttribute(k), 3));
    const Motion motion{
        placed.world_from_node, static_cast<float>(std::log(placed.world_from_node.scale)),
        ShRotation(placed.world_from_node.rotation),
        placed.world_from_node.rotation.vec().norm() > 1e-12, ScalesAreLogarithms(values.scales)};
    // A .glb stores one attribute after the other. Two halves: the first is decoded while the disk
    // reads the second.
    for (size_t half = 0; half < 2; ++half) {
      const auto report = [&](size_t done) {
        const double rows = static_cast<double>(count * half + done) / 2;
        monitor.Step("load", static_cast<double>(done_) + rows,
                     static_cast<double>(model_.NumGaussians()));
      };
      const auto load = [&](size_t begin, size_t end) {
        std::vector<char> room;
        if (half == 0) LoadGeometry(values, motion, begin, end, room);
        LoadColors(values, motion, half, begin, end, room);
      };
      ForRows(count, report, load, kRowsRead);
    }
    done_ += count;
  }

  struct Attributes {
    GltfValues means, quats, scales, opacities;
    std::vector<GltfValues> sh;
  };

  // The transform of a primitive's Gaussians.
  struct Motion {
    Sim3d world_from_node;
    float log_scale;  // the logarithm of its scale
    ShRotation sh_rotation;
    bool turned;
    bool log_scales;  // the file stores logarithms
  };

  // Linear scales are never negative. A draft of the extension had logarithms, nearly all of them
  // negative.
  bool ScalesAreLogarithms(const GltfValues& scales) {
    bool logarithms = false;
    std::vector<float> some(3 * kRowsRead);
    std::vector<char> room;
    for (uint64_t begin = 0; begin < scales.count && !logarithms; begin += kRowsRead) {
      const uint64_t end = std::min<uint64_t>(begin + kRowsRead, scales.count);
      scales.Load<3>(begin, end, some.data(), 3, room);
      logarithms =
          std::any_of(some.begin(), some.begin() + static_cast<ptrdiff_t>(3 * (end - begin)),
                      [](float scale) { return scale < 0; });
    }
    if (logarithms) {
      model_.source.notes.push_back(
          "negative scales were read as logarithms, as a draft of the "
          "extension had them");
    }
    return logarithms;
  }

  // Rows [begin, end) of a primitive.
  void LoadGeometry(const Attributes& values, const Motion& motion, size_t begin, size_t end,
                    std::vector<char>& room) {
    const size_t g = done_ + begin;
    values.means.Load<3>(begin, end, &model_.means[3 * g], 3, room);
    values.quats.Load<4>(begin, end, &model_.quats_wxyz[4 * g], 4, room);   // xyzw until Activate()
    values.scales.Load<3>(begin, end, &model_.log_scales[3 * g], 3, room);  // linear until then
    values.opacities.Load<1>(begin, end, &model_.opacity_logits[g], 1, room);
    for (size_t i = begin; i < end; ++i) Activate(done_ + i, motion);
  }

  // One half of the coefficients; rotation needs both.
  void LoadColors(const Attributes& values, const Motion& motion, size_t half, size_t begin,
                  size_t end, std::vector<char>& room) {
    const size_t middle = values.sh.size() / 2, width = ShWidth();
    float* first = &model_.sh[width * (done_ + begin)];
    // One coefficient after the other: a processor prefetches one place well, but not 16 at once.
    for (size_t k = half * middle; k < (half == 0 ? middle : values.sh.size()); ++k) {
      values.sh[k].Load<3>(begin, end, first + 3 * k, width, room);
    }
    for (size_t i = begin; i < end; ++i, first += width) {
      if (motion.turned && half == 0) continue;
      if (motion.turned) motion.sh_rotation.Apply(model_.sh_degree, first);
      const size_t from = motion.turned || half == 0 ? 1 : middle;
      for (size_t k = std::max<size_t>(from, 1); k < (half == 0 ? middle : width / 3); ++k) {
        for (size_t c = 0; c < 3; ++c) first[3 * k + c] *= ShSign(k, kLeftUpFront);
      }
    }
  }

  // Converts Gaussian `g` from the file's values, without its colors, to the world and the .ply's
  // axes.
  void Activate(size_t g, const Motion& motion) {
    float& opacity = model_.opacity_logits[g];
    if (!(opacity >= 0 && opacity <= 1)) {
      file_.Fail("Gaussian " + std::to_string(g) + ": opacity is not from 0 to 1");
    }
    opacity = Logit(opacity);
    float* log_scales = &model_.log_scales[3 * g];
    for (size_t i = 0; i < 3; ++i) {
      const float scale = log_scales[i];
      log_scales[i] = (motion.log_scales ? scale : LogScale(scale)) + motion.log_scale;
    }
    float* mean = &model_.means[3 * g];
    const Eigen::Vector3d mean_in_world =
        motion.world_from_node * Eigen::Vector3d(mean[0], mean[1], mean[2]);
    for (int i = 0; i < 3; ++i) {
      mean[i] = static_cast<float>(mean_in_world[i]) * kLeftUpFront[size_t(i)];
    }
    float* quat = &model_.quats_wxyz[4 * g];
    std::rotate(quat, quat + 3, quat + 4);
    if (motion.turned) {
      const Eigen::Quaterniond q =
          motion.world_from_node.rotation * Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]);
      quat[0] = float(q.w()), quat[1] = float(q.x()), quat[2] = float(q.y()),
      quat[3] = float(q.z());
    }
    FlipQuat(quat, kLeftUpFront);
  }

  size_t ShWidth() const { return 3 * static_cast<size_t>(model_.NumShCoeffs()); }

  const GltfFile& file_;
  GaussianModel model_;
  std::vector<Placed> placed_;
  std::unordered_set<uint64_t> visited_;
  bool other_meshes_ = false, degree_4_ = false;
  size_t done_ = 0;
};

// ---- Writing

// A part of the buffer: an attribute, and a function for its bytes.
struct Segment {
  std::string attribute;
  size_t bytes_per_value;
  Json accessor;
  std::function<void(const SplatRow& row, char* to)> write;
};

// sRGB to linear (IEC 61966-2-1), for [0, 1].
double LinearOfSrgb(double value) {
  const double kept = std::clamp(value, 0.0, 1.0);
  return kept <= 0.04045 ? kept / 12.92 : std::pow((kept + 0.055) / 1.055, 2.4);
}

template <size_t N>
void StoreFloats(const std::array<float, N>& values, char* to) {
  std::memcpy(to, values.data(), sizeof(values));
}

std::vector<Segment> Segments(const GaussianModel& model) {
  constexpr int kFloat = 5126, kByte = 5121;
  const auto accessor = [&](int component, const char* type) {
    return Json{{"componentType", component}, {"type", type}, {"count", model.NumGaussians()}};
  };
  std::vector<Segment> segments;
  segments.push_back({"POSITION", 12, accessor(kFloat, "VEC3"),
                      [](const SplatRow& row, char* to) { StoreFloats(row.mean, to); }});
  // glTF's vertex colors are linear ("Fallback Behavior").
  const bool linear = IsLinear(model.traits.color_space);
  segments.push_back(
      {"COLOR_0", 4, accessor(kByte, "VEC4"), [linear](const SplatRow& row, char* to) {
         for (size_t i = 0; i < 3; ++i) {
           const double color = 0.5 + double{kShC0} * row.sh[i];
           to[i] = static_cast<char>(RoundTo(255 * (linear ? color : LinearOfSrgb(color)), 255));
         }
         to[3] = static_cast<char>(RoundTo(255 * Sigmoid(row.opacity_logit), 255));
       }});
  segments.back().accessor["normalized"] = true;
  segments.push_back(
      {Attribute("ROTATION"), 16, accessor(kFloat, "VEC4"), [](const SplatRow& row, char* to) {
         const std::array<double, 4> q = Normalized(row.quat_wxyz);
         StoreFloats<4>({float(q[1]), float(q[2]), float(q[3]), float(q[0])}, to);
       }});
  segments.push_back(
      {Attribute("SCALE"), 12, accessor(kFloat, "VEC3"), [](const SplatRow& row, char* to) {
         std::array<float, 3> scale;
         for (size_t i = 0; i < 3; ++i) {
           scale[i] = std::exp(std::min(row.log_scale[i], 88.0f));  // finite
         }
         StoreFloats(scale, to);
       }});
  segments.push_back(
      {Attribute("OPACITY"), 4, accessor(kFloat, "SCALAR"), [](const SplatRow& row, char* to) {
         StoreFloats<1>({static_cast<float>(Sigmoid(row.opacity_logit))}, to);
       }});
  for (int k = 0; k < model.NumShCoeffs(); ++k) {
    segments.push_back(
        {ShAttribute(k), 12, accessor(kFloat, "VEC3"), [k](const SplatRow& row, char* to) {
           std::memcpy(to, &row.sh[static_cast<size_t>(k) * 3], 12);
         }});
  }
  return segments;
}

// The bounds that the specification requires.
void AddBounds(const GaussianModel& model, Json& accessor) {
  std::array<float, 3> least, most;
  least.fill(std::numeric_limits<float>::max());
  most.fill(std::numeric_limits<float>::lowest());
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    for (size_t i = 0; i < 3; ++i) {
      const float x = kLeftUpFront[i] * model.means[3 * g + i];
      least[i] = std::min(least[i], x);
      most[i] = std::max(most[i], x);
    }
  }
  accessor["min"] = least;
  accessor["max"] = most;
}

Json Document(const GaussianModel& model, std::vector<Segment>& segments, uint64_t& bytes) {
  AddBounds(model, segments[0].accessor);
  Json views = Json::array(), accessors = Json::array(), attributes;
  bytes = 0;
  for (Segment& segment : segments) {
    const uint64_t length = segment.bytes_per_value * model.NumGaussians();
    segment.accessor["bufferView"] = views.size();
    attributes[segment.attribute] = accessors.size();
    views.push_back(
        {{"buffer", 0}, {"byteOffset", bytes}, {"byteLength", length}, {"target", 34962}});
    accessors.push_back(segment.accessor);
    bytes += length;
  }
  const ColorSpace space =
      IsLinear(model.traits.color_space) ? ColorSpace::kLinearDisplay : ColorSpace::kSrgbDisplay;
  const Json extension = {{"kernel", "ellipse"},
                          {"colorSpace", NameOf(space)},
                          {"sortingMethod", "cameraDistance"},
                          {"projection", "perspective"}};
  Json primitive = {{"mode", 0}};
  primitive["attributes"] = attributes;
  primitive["extensions"][kExtension] = extension;
  Json document;
  document["asset"] = {{"version", "2.0"}, {"generator", "Retint"}};
  document["extensionsUsed"] = Json::array({kExtension});
  document["scene"] = 0;
  document["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  document["nodes"] = Json::array({{{"mesh", 0}}});
  document["meshes"] = Json::array({{{"primitives", Json::array({primitive})}}});
  document["buffers"] = Json::array({{{"byteLength", bytes}}});
  document["bufferViews"] = views;
  document["accessors"] = accessors;
  return document;
}

// Every value has a multiple of 4 bytes, so padding is not needed.
void WriteSegments(const GaussianModel& model, const std::vector<Segment>& segments,
                   Monitor& monitor, const std::function<void(std::string_view)>& write) {
  const size_t count = model.NumGaussians();
  std::string block;
  for (size_t s = 0; s < segments.size(); ++s) {
    const size_t width = segments[s].bytes_per_value;
    for (size_t first = 0; first < count; first += kBlockRows) {
      monitor.Step("save", static_cast<double>(s * count + first),
                   static_cast<double>(segments.size() * count));
      const size_t end = std::min(count, first + kBlockRows);
      block.resize((end - first) * width);
      for (size_t g = first; g < end; ++g) {
        segments[s].write(FlipAxes(GetRow(model, g), kLeftUpFront),
                          block.data() + (g - first) * width);
      }
      write(block);
    }
  }
}

}  // namespace

std::span<const std::string_view> GltfCodec::Extensions() const {
  static constexpr std::array<std::string_view, 2> extensions = {".glb", ".gltf"};
  return extensions;
}

bool GltfCodec::Sniff(std::string_view head) const { return head.starts_with("glTF"); }

GaussianModel GltfCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                              BadRows bad) const {
  monitor.Step("load", 0, 1);
  const GltfFile file(path);
  GaussianModel model = SceneReader(file).Read(monitor);
  ValidateRead(model, path, bad);
  return model;
}

std::vector<std::filesystem::path> GltfCodec::Files(const std::filesystem::path& path) const {
  return GltfFile(path).files();
}

void GltfCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                      Monitor& monitor) const {
  ValidateWrite(model, path);
  std::vector<Segment> segments = Segments(model);
  uint64_t bytes = 0;
  Json document = Document(model, segments, bytes);
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  AtomicFile file(path);
  if (extension == ".gltf") {
    // A mark in the JSON text is replaced by the buffer's data.
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64,@";
    const std::string text = document.dump(1);
    const size_t mark = text.find(",@\"") + 1;
    Base64Encoder encoder;
    file.Write(std::string_view(text).substr(0, mark));
    WriteSegments(model, segments, monitor,
                  [&](std::string_view block) { file.Write(encoder.Add(block)); });
    file.Write(encoder.Finish());
    file.Write(std::string_view(text).substr(mark + 1));
  } else {
    std::string text = document.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const uint64_t length = 12 + 8 + text.size() + 8 + bytes;
    if (length > std::numeric_limits<uint32_t>::max()) {
      throw RunError(path.string() + ": not written: a .glb holds 4 GiB at most");
    }
    file.Write("glTF");
    for (const uint64_t word : {uint64_t{2}, length, uint64_t{text.size()}}) {
      file.WriteValue(static_cast<uint32_t>(word));
    }
    file.Write("JSON");
    file.Write(text);
    file.WriteValue(static_cast<uint32_t>(bytes));
    file.Write(std::string_view("BIN\0", 4));
    WriteSegments(model, segments, monitor, [&](std::string_view block) { file.Write(block); });
  }
  file.Commit();
}

std::vector<std::string> GltfCodec::Losses(const GaussianModel& model) const {
  return CommonLosses(model, 3, Name(), {}, std::array{ColorSpace::kLinearDisplay});
}

}  // namespace retint
