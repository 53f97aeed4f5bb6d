// SPDX-License-Identifier: BSD-3-Clause
// Files that are missing, truncated or damaged, or have impossible contents.
#include <limits>

#include "splat_io/splat_io.h"
#include "tests/e2e/bad_input.h"

namespace retint {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

const Row kFileRows[] = {
    // Files that are missing.
    {"NoWorkspace", 3, "nowhere",
     [](Place& p) {
       return Recolor(p, {"SCENE", p.In("nowhere")});
     }},
    {"WorkspaceWithoutModel", 3, "in",
     [](Place& p) {
       fs::remove_all(p.in / "sparse");
       return Recolor(p);
     }},
    {"NoImagesBin", 3, "images.bin",
     [](Place& p) {
       fs::remove(p.in / "sparse/0/images.bin");
       return Recolor(p);
     }},
    {"NoSplat", 3, "gone.ply",
     [](Place& p) {
       return Recolor(p, {"--splat", p.In("gone.ply")});
     }},
    {"SplatIsAFolder", 3, "images",
     [](Place& p) {
       return Recolor(p, {"--splat", p.In("images")});
     }},
    {"NoMask", 3, "gone.png",
     [](Place& p) {
       return Recolor(p, {"--mask", p.In("gone.png")});
     }},
    {"NoMaskFolder", 3, "gone",
     [](Place& p) {
       return With(p, "refit",
                   {"--masks", p.In("gone"), "--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    {"NoCloud", 3, "gone.ply",
     [](Place& p) {
       return With(p, "project", {"--cloud", p.In("gone.ply"), "--output", p.Out("masks")});
     }},
    {"UnknownModel", 3, "no sparse model \"7\"; there is sparse/0",
     [](Place& p) {
       return Recolor(p, {"--model", "7"});
     }},
    {"WorldFromSplatOfNoSimilarity", 2, "--world-from-splat",
     [](Place& p) {
       return Recolor(p, {"--world-from-splat", "1 2 3"});
     }},
    {"WorldFromSplatOfAnotherFile", 3, "splat.ply",
     [](Place& p) {
       return Recolor(p, {"--world-from-splat", p.In("splat.ply")});
     }},
    {"CamerasOfNoSplat", 3, "gone.ply",
     [](Place& p) {
       return Arguments{"cameras", p.In("gone.ply"), "--output", p.Out("ws")};
     }},
    {"AlignToNothing", 3, "neither photos nor sparse points",
     [](Place& p) {
       fs::remove_all(p.in / "images");
       fs::remove(p.in / "sparse/0/points3D.bin");
       // The missing points have a warning of their own.
       return With(p, "align", {"--transform", p.Out("t.json"), "--log-level", "error"});
     }},
    {"NoDenseMaps", 3, "depth",
     [](Place& p) {
       return Recolor(p, {"--depth-method", "colmap"});
     }},
    {"NoImageFolder", 3, "elsewhere",
     [](Place& p) {
       return Recolor(p, {"--images", p.In("elsewhere")});
     }},
    // Files that are cut off or damaged.
    {"CutCameras", 3, "cameras.bin",
     [](Place& p) {
       Truncate(p.in / "sparse/0/cameras.bin", 0.6);
       return Recolor(p);
     }},
    {"CutImages", 3, "images.bin",
     [](Place& p) {
       Truncate(p.in / "sparse/0/images.bin", 0.6);
       return Recolor(p);
     }},
    {"CutPoints", 3, "points3D.bin",
     [](Place& p) {
       fs::resize_file(p.in / "sparse/0/points3D.bin", 5);
       return Recolor(p);
     }},
    {"CutSplat", 3, "splat.ply",
     [](Place& p) {
       Truncate(p.in / "splat.ply", 0.7);
       return Recolor(p);
     }},
    {"EmptySplat", 3, "splat.ply",
     [](Place& p) {
       fs::resize_file(p.in / "splat.ply", 0);
       return Recolor(p);
     }},
    {"SplatIsText", 3, "splat.ply",
     [](Place& p) {
       WriteFile(p.in / "splat.ply", "not a splat at all\n");
       return Recolor(p);
     }},
    {"MaskIsText", 3, ".png",
     [](Place& p) {
       WriteFile(MaskOf(p), "not a picture");
       return Recolor(p);
     }},
    {"CutPhoto", 3, "002.png",
     [](Place& p) {
       Truncate(p.in / "images/002.png", 0.5);
       return Recolor(p, {"--target", "photo"});
     }},
    {"CutCloud", 3, "cloud.ply",
     [](Place& p) {
       WriteCloud(p.in / "cloud.ply", CloudAt({0, 0, 0}));
       Truncate(p.in / "cloud.ply", 0.8);
       return With(p, "project", {"--cloud", p.In("cloud.ply"), "--output", p.Out("masks")});
     }},
    // Counts that exceed the file.
    {"TooManyImages", 3, "images.bin",
     [](Place& p) {
       Overwrite<uint64_t>(p.in / "sparse/0/images.bin", 0, uint64_t{1} << 60);
       return Recolor(p);
     }},
    {"TooManyPoints", 3, "points3D.bin",
     [](Place& p) {
       Overwrite<uint64_t>(p.in / "sparse/0/points3D.bin", 0, ~uint64_t{0});
       return Recolor(p);
     }},
    {"TooManyGaussians", 3, "splat.ply",
     [](Place& p) {
       const std::string count = std::to_string(ReadSplat(p.in / "splat.ply").NumGaussians());
       Replace(p.in / "splat.ply", "vertex " + count, "vertex 99999999999999");
       return Recolor(p);
     }},
    // Values that are no numbers.
    {"NanMean", 3, "splat.ply",
     [](Place& p) {
       SpoilGaussian(p.in / "splat.ply", "y", kNan);
       return Recolor(p);
     }},
    {"InfiniteColor", 3, "splat.ply",
     [](Place& p) {
       SpoilGaussian(p.in / "splat.ply", "f_dc_0", kInfinity);
       return Recolor(p);
     }},
    {"NanFocalLength", 3, "cameras.bin",
     [](Place& p) {
       Overwrite<double>(p.in / "sparse/0/cameras.bin", 8 + 4 + 4 + 8 + 8,
                         std::numeric_limits<double>::quiet_NaN());
       return Recolor(p);
     }},
    {"NanCloud", 3, "cloud.ply",
     [](Place& p) {
       WriteCloud(p.in / "cloud.ply", CloudAt({0, kNan, 0}));
       return With(p, "project", {"--cloud", p.In("cloud.ply"), "--output", p.Out("masks")});
     }},
    {"UnknownCameraModel", 3, "cameras.bin",
     [](Place& p) {
       Overwrite<int32_t>(p.in / "sparse/0/cameras.bin", 8 + 4, 77);
       return Recolor(p);
     }},
    // A lens that folds its picture over itself.
    {"FoldingCamera", 3, "camera 1 (SIMPLE_RADIAL): its distortion folds the picture",
     [](Place& p) {
       // SIMPLE_RADIAL has four parameters, as PINHOLE.
       Overwrite<int32_t>(p.in / "sparse/0/cameras.bin", 8 + 4, 2);
       Overwrite<double>(p.in / "sparse/0/cameras.bin", 8 + 4 + 4 + 8 + 8 + 3 * 8, -60);
       return Recolor(p);
     }},
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Files, BadInput, testing::ValuesIn(kFileRows), RowName);

}  // namespace retint
