// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <random>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "colmap_io/nerfstudio.h"
#include "colmap_io/photo.h"
#include "colmap_io/sparse.h"
#include "network/pixel_file.h"
#include "scene/sh_band4.h"
#include "splat_io/splat_io.h"
#include "tests/fuzz/targets.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// ---- Splats

GaussianModel SmallScene(int degree) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> draw(-1, 1);
  GaussianModel model;
  model.Resize(7, std::min(degree, 3));
  if (degree > 3) ShBand4Columns::AddTo(model);
  for (auto* values :
       {&model.means, &model.quats_wxyz, &model.log_scales, &model.opacity_logits, &model.sh}) {
    for (float& value : *values) value = draw(random);
  }
  return model;
}

// In a folder that goes again.
template <typename Write>
std::string Written(const char* name, const Write& write) {
  std::string folder = (fs::temp_directory_path() / "retint-seed-XXXXXX").string();
  if (!mkdtemp(folder.data())) throw RunError(folder + ": cannot be made");
  write(fs::path(folder) / name);
  std::string bytes = ReadFile(fs::path(folder) / name);
  fs::remove_all(folder);
  return bytes;
}

std::vector<std::string> SplatSeeds(const char* name) {
  std::vector<std::string> seeds;
  for (const int degree : {0, 1, 3, 4}) {
    seeds.push_back(
        Written(name, [&](const fs::path& path) { WriteSplat(path, SmallScene(degree)); }));
  }
  return seeds;
}

// A .ply in text, with a list behind the Gaussians.
std::vector<std::string> PlySeeds() {
  std::vector<std::string> seeds = SplatSeeds("a.ply");
  std::string text = "ply\nformat ascii 1.0\ncomment of the seed\nelement vertex 2\n";
  for (const char* column : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    text += std::string("property double ") + column + "\n";
  }
  text += "property uchar label\nelement face 1\nproperty list uchar int vertex_indices\n";
  text += "end_header\n";
  for (int row = 0; row < 2; ++row) text += "0 1 2 .5 -.5 1e-3 4 -3 -3 -3 1 0 0 0 7\n";
  seeds.push_back(text + "3 0 1 0\n");
  return seeds;
}

// As another program lays it out: halves, transforms, other prims, all kinds of values.
std::vector<std::string> UsdaSeeds() {
  std::vector<std::string> seeds = SplatSeeds("a.usda");
  seeds.push_back(R"(#usda 1.0
(
    """A stage
"""
    upAxis = "Z"
    metersPerUnit = 0.01
    customLayerData = { dictionary a = { string b = "}" } }
    subLayers = [ @a.usda@ (offset = 1) ]
)
class "Looks" { }
def Xform "World" (
    kind = "component"
    prepend references = @b.usdc@</B> (scale = 2)
    variants = { string shape = "round" }
)
{
    double3 xformOp:translate = (1, -2, 3e0)
    quatd xformOp:orient = (1, 0, 0, 0)
    float3 xformOp:rotateXYZ = (10, 20, 30)
    matrix4d xformOp:transform:more = ((2,0,0,0),(0,2,0,0),(0,0,2,0),(1,2,3,1))
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:orient", "xformOp:rotateXYZ",
        "xformOp:transform:more", "!invert!xformOp:translate"]
    variantSet "shape" = { "round" { int a = 1 } }
    def ParticleField3DGaussianSplat "Splats" (active = true)
    {
        point3h[] positionsh = [(0, 0, 0), (1, 1, 1)] # two
        quath[] orientationsh = [(1, 0, 0, 0), (0.5, 0.5, 0.5, 0.5)]
        half3[] scalesh = [(0.1, 0.1, 0.1), (1, 1, 1)]
        half[] opacitiesh = [0.5, 1]
        half3[] radiance:sphericalHarmonicsCoefficientsh = [(1, 0, 0), (0, 1, 0)] (elementSize = 1)
        uniform int radiance:sphericalHarmonicsDegree = 0
        custom rel target = </World>
        float a.timeSamples = { 0: 1.5, 1: None, }
    }
    over "Chair" { token visibility = "invisible" float3[] extent = None }
}
)");
  return seeds;
}

// Every readable file is written too: codecs patch the bytes of their source.
void ReadAnySplat(const fs::path& folder, const char* name) {
  const GaussianModel model = ReadSplat(folder / name);
  model.Validate();
  if (model.NumGaussians() > 4096 || std::string_view(name) == "a.ksplat") return;
  GaussianModel edited = model;
  for (size_t i = 0; i < edited.sh.size(); i += 5) edited.sh[i] = 0.25F;
  WriteSplat(folder / (std::string("out_") + name), edited);
}

// Indices of the chunks of WriteChunks().
std::vector<std::string> LevelsSeeds() {
  return {R"({"version": 1, "count": 7, "counts": [7], "lodLevels": 1,
"filenames": ["0_0/meta.json"], "tree": {"bound": {"min": [-1, -1, -1], "max": [1, 1, 1]},
"children": [{"lods": {"0": {"file": 0, "offset": 0, "count": 3}}},
{"lods": {"0": {"file": 0, "offset": 3, "count": 4}}}]}})",
          R"({"lodLevels": 2, "environment": null, "filenames": ["0_0/meta.json", "1_0/meta.json"],
"tree": {"lods": {"0": {"file": 0, "offset": 0, "count": 7},
"1": {"file": 1, "offset": 0, "count": 7}}}})"};
}

void WriteChunks(const fs::path& folder) {
  for (const char* name : {"0_0", "1_0"}) WriteSplat(folder / name / "meta.json", SmallScene(1));
}

void ReadLevels(const fs::path& folder) {
  GaussianModel model = ReadSplat(folder / "lod-meta.json");
  model.Validate();
  model.sh[0] = 0.25F;
  WriteSplat(folder / "out" / "lod-meta.json", model);
}

// ---- COLMAP

Reconstruction SmallModel() {
  Reconstruction model;
  model.cameras[1] = Camera::Pinhole(1, 64, 48, 50, 51, 32, 24);
  model.cameras[7] = {7, CameraModelId::kOpenCV, 64, 48, {50, 50, 32, 24, 0.1, 0.01, 1e-3, 1e-3}};
  for (ViewId id = 1; id <= 3; ++id) {
    View& view = model.views[id];
    view.id = id;
    view.name = "sub/photo " + std::to_string(id) + ".jpg";
    view.camera_id = id == 2 ? 7 : 1;
    view.cam_from_world.translation = {0.1 * id, 0, 1};
    view.observations = {{{10.5, 11.5}, 4}, {{20, 30}, kInvalidPointId}};
  }
  SparsePoint& point = model.points[4];
  point.id = 4;
  point.xyz = {1, 2, 3};
  for (ViewId id = 1; id <= 3; ++id) point.track.push_back({id, 0});
  return model;
}

template <bool kText>
void WriteSmallModel(const fs::path& folder) {
  kText ? WriteReconstructionText(folder, SmallModel())
        : WriteReconstructionBinary(folder, SmallModel());
}

void ReadModel(const fs::path& folder) {
  std::vector<std::string> warnings;
  ReadReconstruction(folder, &warnings);
}

template <bool kText>
std::vector<std::string> ModelSeeds(const char* name) {
  return {Written(name, [](const fs::path& path) { WriteSmallModel<kText>(path.parent_path()); })};
}

// A rig of two cameras and one frame of it, which stand for images.
constexpr char kRigs[] = "7 2 CAMERA 1 CAMERA 7 1 0 1 0 0 -1 0 0\n8 1 IMU 1\n";
constexpr char kFrames[] = "4 7 1 0 0 0 0 0 5 2 CAMERA 1 1 CAMERA 7 2\n5 7 1 0 0 0 0 0 6 0\n";

template <typename... Values>
std::string BytesOf(Values... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

std::string BinaryRigs() {
  return BytesOf(uint64_t{1}, 7U, 2U, 0, 1U, 0, 7U, uint8_t{1}, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0);
}

std::string BinaryFrames() {
  return BytesOf(uint64_t{1}, 4U, 7U, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 2U, 0, 1U, uint64_t{1}, 0,
                 7U, uint64_t{2});
}

template <bool kText>
void WriteModelOfFrames(const fs::path& folder) {
  WriteSmallModel<kText>(folder);
  fs::remove(folder / (kText ? "images.txt" : "images.bin"));
  WriteFile(folder / (kText ? "rigs.txt" : "rigs.bin"), kText ? kRigs : BinaryRigs());
  WriteFile(folder / (kText ? "frames.txt" : "frames.bin"), kText ? kFrames : BinaryFrames());
}

std::vector<std::string> TransformsSeeds() {
  return {R"({"camera_model": "OPENCV", "fl_x": 50, "fl_y": 50, "cx": 32, "cy": 24, "w": 64,
"h": 48, "k1": 0.1, "k2": 0.01, "p1": 0, "p2": 0, "applied_transform": [[1, 0, 0, 0],
[0, 0, 1, 0], [0, -1, 0, 0]], "frames": [{"file_path": "images/a.png", "transform_matrix":
[[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}]})",
          R"({"camera_angle_x": 0.7, "w": 64, "h": 48, "frames": [{"file_path": "./b",
"transform_matrix": [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}]})"};
}

std::vector<std::string> PlacementSeeds() {
  return {R"({"transform": [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0]], "scale": 0.3})",
          R"({"world_from_splat": [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0]})"};
}

// ---- Pictures and depth maps

void ReadPicture(const fs::path& folder) {
  const fs::path path = folder / "a.png";
  ReadImageSize(path);
  // Decoders are other people's: large announced sizes are theirs to refuse.
  const auto size = ReadImageSize(path);
  if (size && int64_t{size->first} * size->second > 4'000'000) return;
  ReadImage(path);
  ReadMask(path);
}

std::vector<std::string> PictureSeeds() {
  Image8 picture(9, 7);
  for (size_t i = 0; i < picture.data.size(); ++i) picture.data[i] = static_cast<uint8_t>(i * 13);
  return {EncodePng(Mask(9, 7, 200)), EncodeJpeg(picture, 80)};
}

std::vector<std::string> DepthSeeds() {
  return {Written("a.bin", [](const fs::path& path) { WriteDepthMap(path, DepthMap(5, 4, 2)); })};
}

// ---- Pixels that programs write

std::string Npy(const std::string& type, size_t bytes) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (1, 3, 2), }";
  header.resize(118, ' ');
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + std::string(6 * bytes, '\x3c');
}

std::vector<std::string> NpySeeds() {
  return {Npy("<f4", 4), Npy("|b1", 1), Npy(">i2", 2), Npy("<f2", 2), Npy("<f8", 8)};
}

std::vector<std::string> PfmSeeds() {
  return {"Pf\n3 2\n-1.0\n" + std::string(24, '\x3f'), "Pf 1 1 1 " + std::string(4, '\0')};
}

}  // namespace

std::span<const FuzzTarget> ReaderTargets() {
  static const FuzzTarget targets[] = {
      {"ply",
       "a.ply",
       [](const fs::path& f) { ReadAnySplat(f, "a.ply"); },
       nullptr,
       PlySeeds,
       {"splats/test-splat.3-points-from-train.ply"}},
      {"compressed_ply",
       "a.compressed.ply",
       [](const fs::path& f) { ReadAnySplat(f, "a.compressed.ply"); },
       nullptr,
       [] { return SplatSeeds("a.compressed.ply"); },
       {}},
      {"splat",
       "a.splat",
       [](const fs::path& f) { ReadAnySplat(f, "a.splat"); },
       nullptr,
       [] { return SplatSeeds("a.splat"); },
       {"splats/minimal.splat", "splats/test-splat.3-points-from-train.splat"}},
      {"spz",
       "a.spz",
       [](const fs::path& f) { ReadAnySplat(f, "a.spz"); },
       nullptr,
       [] { return SplatSeeds("a.spz"); },
       {"splats/minimal-raw.spz", "splats/minimal-v2.spz", "splats/minimal-v3.spz",
        "splats/minimal-v4.spz", "splats/test-splat.3-points-from-train.spz"}},
      {"ksplat",
       "a.ksplat",
       [](const fs::path& f) { ReadAnySplat(f, "a.ksplat"); },
       nullptr,
       [] { return std::vector<std::string>{std::string(4096 + 1024 + 64, '\0')}; },
       {"splats/minimal.ksplat"}},
      {"sog",
       "a.sog",
       [](const fs::path& f) { ReadAnySplat(f, "a.sog"); },
       nullptr,
       [] { return SplatSeeds("a.sog"); },
       {}},
      {"sog_meta",
       "meta.json",
       [](const fs::path& f) { ReadSplat(f / "meta.json"); },
       [](const fs::path& f) { WriteSplat(f / "meta.json", SmallScene(1)); },
       [] { return SplatSeeds("meta.json"); },
       {}},
      {"lod_meta", "lod-meta.json", ReadLevels, WriteChunks, LevelsSeeds, {}},
      {"glb",
       "a.glb",
       [](const fs::path& f) { ReadAnySplat(f, "a.glb"); },
       nullptr,
       [] { return SplatSeeds("a.glb"); },
       {}},
      {"gltf",
       "a.gltf",
       [](const fs::path& f) { ReadAnySplat(f, "a.gltf"); },
       nullptr,
       [] { return SplatSeeds("a.gltf"); },
       {}},
      {"usda",
       "a.usda",
       [](const fs::path& f) { ReadAnySplat(f, "a.usda"); },
       nullptr,
       UsdaSeeds,
       {}},
      {"usdc",
       "a.usdc",
       [](const fs::path& f) { ReadAnySplat(f, "a.usdc"); },
       nullptr,
       [] { return SplatSeeds("a.usdc"); },
       {}},
      {"usdz",
       "a.usdz",
       [](const fs::path& f) { ReadAnySplat(f, "a.usdz"); },
       nullptr,
       [] { return SplatSeeds("a.usdz"); },
       {}},
      {"cameras_bin",
       "cameras.bin",
       ReadModel,
       WriteSmallModel<false>,
       [] { return ModelSeeds<false>("cameras.bin"); },
       {}},
      {"images_bin",
       "images.bin",
       ReadModel,
       WriteSmallModel<false>,
       [] { return ModelSeeds<false>("images.bin"); },
       {}},
      {"points_bin",
       "points3D.bin",
       ReadModel,
       WriteSmallModel<false>,
       [] { return ModelSeeds<false>("points3D.bin"); },
       {}},
      {"cameras_txt",
       "cameras.txt",
       ReadModel,
       WriteSmallModel<true>,
       [] { return ModelSeeds<true>("cameras.txt"); },
       {}},
      {"images_txt",
       "images.txt",
       ReadModel,
       WriteSmallModel<true>,
       [] { return ModelSeeds<true>("images.txt"); },
       {}},
      {"points_txt",
       "points3D.txt",
       ReadModel,
       WriteSmallModel<true>,
       [] { return ModelSeeds<true>("points3D.txt"); },
       {}},
      {"rigs_bin",
       "rigs.bin",
       ReadModel,
       WriteModelOfFrames<false>,
       [] { return std::vector<std::string>{BinaryRigs()}; },
       {}},
      {"frames_bin",
       "frames.bin",
       ReadModel,
       WriteModelOfFrames<false>,
       [] { return std::vector<std::string>{BinaryFrames()}; },
       {}},
      {"rigs_txt",
       "rigs.txt",
       ReadModel,
       WriteModelOfFrames<true>,
       [] { return std::vector<std::string>{kRigs}; },
       {}},
      {"frames_txt",
       "frames.txt",
       ReadModel,
       WriteModelOfFrames<true>,
       [] { return std::vector<std::string>{kFrames}; },
       {}},
      {"transforms",
       "transforms.json",
       [](const fs::path& f) {
         std::vector<std::string> warnings;
         ReadTransforms(f / "transforms.json", &warnings);
       },
       nullptr,
       TransformsSeeds,
       {}},
      {"world_from_splat",
       "t.json",
       [](const fs::path& f) { ReadWorldFromSplat(f / "t.json"); },
       nullptr,
       PlacementSeeds,
       {}},
      {"picture", "a.png", ReadPicture, nullptr, PictureSeeds, {}},
      {"depth_map",
       "a.bin",
       [](const fs::path& f) { ReadDepthMap(f / "a.bin"); },
       nullptr,
       DepthSeeds,
       {}},
      {"npy", "a.npy", [](const fs::path& f) { ReadPixels(f / "a.npy"); }, nullptr, NpySeeds, {}},
      {"pfm", "a.pfm", [](const fs::path& f) { ReadPixels(f / "a.pfm"); }, nullptr, PfmSeeds, {}},
  };
  return targets;
}

}  // namespace retint
