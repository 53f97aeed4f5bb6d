// SPDX-License-Identifier: BSD-3-Clause
// What bad input gets: one line on stderr that names file and fault, the right exit code, and no
// output. One row a fault.
#include <sys/mount.h>
#include <unistd.h>

#include <cstring>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "selection/selection_cloud.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"
#include "tests/support/privileges.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// A spoilt copy of the sample workspace and where outputs would go.
struct Place {
  TempFolder temp;
  fs::path in = temp.path() / "in", out = temp.path() / "out";
  Place() {
    fs::create_directories(out);
    fs::create_directories(in);
    for (const char* part : {"sparse", "images", "masks", "splat.ply"}) {
      fs::copy(TinyWorkspace() / part, in / part, fs::copy_options::recursive);
    }
  }
  std::string In(const std::string& name) const { return (in / name).string(); }
  std::string Out(const std::string& name) const { return (out / name).string(); }
};

using Arguments = std::vector<std::string>;

struct Row {
  const char* name;
  int code;
  const char* says;  // part of the line
  // Spoils the copy and says what to run.
  Arguments (*prepare)(Place& place);
};

Arguments With(const Place& place, const std::string& verb, const Arguments& more) {
  Arguments arguments = {verb, "--workspace", place.in.string(), "--splat", place.In("splat.ply")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// A whole recolor of the copy; `key value` pairs replace options or add them.
Arguments Recolor(const Place& place, const Arguments& replace = {}) {
  Arguments arguments =
      With(place, "recolor",
           {"--view", TinyView(), "--mask", place.In("masks/" + TinyView() + ".png"), "--tint",
            "#3060ff", "--output", place.Out("out.ply"), "--report", place.Out("r.json"),
            "--save-stages", place.Out("stages"), "--comparison", place.Out("c.png")});
  for (size_t i = 0; i + 1 < replace.size(); i += 2) {
    const auto found = std::find(arguments.begin(), arguments.end(), replace[i]);
    if (found != arguments.end()) {
      *(found + 1) = replace[i + 1];
    } else {
      arguments.insert(arguments.end(), {replace[i], replace[i + 1]});
    }
  }
  return arguments;
}

void Truncate(const fs::path& path, double share) {
  fs::resize_file(path, static_cast<uintmax_t>(share * static_cast<double>(fs::file_size(path))));
}

template <typename T>
void Overwrite(const fs::path& path, size_t offset, T value) {
  std::string bytes = ReadFile(path);
  std::memcpy(bytes.data() + offset, &value, sizeof value);
  WriteFile(path, bytes);
}

void Replace(const fs::path& path, const std::string& from, const std::string& to) {
  std::string bytes = ReadFile(path);
  const size_t at = bytes.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  WriteFile(path, bytes.replace(at, from.size(), to));
}

// Value `which` of the first Gaussian: the header names the columns in order, four bytes each.
void SpoilGaussian(const fs::path& path, const std::string& column, float value) {
  const std::string bytes = ReadFile(path);
  const size_t data = bytes.find("end_header\n") + std::strlen("end_header\n");
  size_t index = 0, at = 0;
  while ((at = bytes.find("property float ", at)) < data) {
    at += std::strlen("property float ");
    if (bytes.compare(at, column.size() + 1, column + "\n") == 0) break;
    ++index;
  }
  Overwrite(path, data + 4 * index, value);
}

fs::path MaskOf(const Place& place) { return place.in / "masks" / (TinyView() + ".png"); }

SelectionCloud CloudAt(const Eigen::Vector3f& position) {
  SelectionCloud cloud;
  for (int i = 0; i < 50; ++i) {
    SelectionPoint point;
    point.position = position + Eigen::Vector3f(0, 0, 0.01F * static_cast<float>(i));
    point.normal = {0, 0, -1};
    point.footprint = 0.01F;
    cloud.points.push_back(point);
  }
  cloud.sources = {"000.png"};
  return cloud;
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

const Row kRows[] = {
    // Files that are missing.
    {"NoWorkspace", 3, "nowhere",
     [](Place& p) {
       return Recolor(p, {"--workspace", p.In("nowhere")});
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
       return Arguments{"cameras", "--splat", p.In("gone.ply"), "--output", p.Out("ws")};
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
       return Recolor(p, {"--depth", "colmap"});
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
    // Masks.
    {"EmptyMask", 3, ".png",
     [](Place& p) {
       WritePng(MaskOf(p), Mask(160, 120));
       return Recolor(p);
     }},
    {"MaskOfAnotherSize", 3, "160",
     [](Place& p) {
       WritePng(MaskOf(p), Mask(80, 60, 255));
       return Recolor(p);
     }},
    {"RefitMaskOfAnotherSize", 3, "001.png.png",
     [](Place& p) {
       WritePng(p.in / "m/001.png.png", Mask(80, 60, 255));
       return With(p, "refit",
                   {"--masks", p.In("m"), "--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    {"RefitMasksAllEmpty", 3, "no mask has a selected pixel",
     [](Place& p) {
       for (int i = 0; i < 8; ++i) {
         WritePng(p.in / ("m/00" + std::to_string(i) + ".png.png"), Mask(160, 120));
       }
       return With(p, "refit",
                   {"--masks", p.In("m"), "--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    {"RefitMasksOfNoView", 3, "m",
     [](Place& p) {
       WritePng(p.in / "m/other.png.png", Mask(160, 120, 255));
       return With(p, "refit",
                   {"--masks", p.In("m"), "--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    // Views and selections.
    {"NoSuchView", 3, "001.png",
     [](Place& p) {
       return Recolor(p, {"--view", "001.pgn"});
     }},
    {"NoSuchViewToRender", 3, "003.png",
     [](Place& p) {
       return With(p, "render", {"--view", "0003.png", "--output", p.Out("r")});
     }},
    {"SelectionErasedWhole", 3, "empty",
     [](Place& p) {
       WritePng(p.in / "all.png", Mask(160, 120, 255));
       RunRetint(With(p, "select",
                      {"--view", TinyView(), "--mask", MaskOf(p).string(), "--output",
                       p.In("cloud.ply"), "--method", "gaussian"}));
       EXPECT_FALSE(ReadCloud(p.in / "cloud.ply").points.empty());
       return With(p, "select",
                   {"--view", TinyView(), "--append", p.In("cloud.ply"), "--erase", p.In("all.png"),
                    "--output", p.Out("c.ply"), "--method", "gaussian"});
     }},
    {"CloudWithoutPoints", 3, "cloud.ply",
     [](Place& p) {
       WriteCloud(p.in / "cloud.ply", SelectionCloud{});
       return With(p, "project", {"--cloud", p.In("cloud.ply"), "--output", p.Out("masks")});
     }},
    {"SelectionThatReachesNoView", 3, "no view",
     [](Place& p) {
       WriteCloud(p.in / "cloud.ply", CloudAt({0, 0, -1e6F}));
       return With(
           p, "project",
           {"--cloud", p.In("cloud.ply"), "--output", p.Out("masks"), "--projector", "surfels"});
     }},
    {"EvaluateOfAnotherSplat", 3, "other.ply",
     [](Place& p) {
       GaussianModel model = ReadSplat(p.in / "splat.ply");
       model.Resize(100, model.sh_degree);
       model.source = {};
       WriteSplat(p.in / "other.ply", model);
       return Arguments{"evaluate",        "--workspace", p.in.string(),     "--before",
                        p.In("splat.ply"), "--after",     p.In("other.ply"), "--masks",
                        p.In("masks"),     "--tint",      "1,0,0",           "--report",
                        p.Out("r.json")};
     }},
    // Usage.
    {"NegativeTint", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "-1,0,0"});
     }},
    {"NanTint", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "nan,0,0"});
     }},
    {"TintOfTwo", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "1,0"});
     }},
    {"TintInWords", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "blue"});
     }},
    {"ShortHexTint", 2, "tint",
     [](Place& p) {
       return Recolor(p, {"--tint", "#30f"});
     }},
    {"UnknownOperation", 3, "operations[0]: there is no operation \"paint\"",
     [](Place& p) {
       WriteFile(p.in / "edit.json", R"({"operations": [{"op": "paint"}]})");
       return Recolor(p, {"--edit", p.In("edit.json")});
     }},
    {"EditCutOff", 3, "is not JSON, or cut off",
     [](Place& p) {
       WriteFile(p.in / "edit.json", R"({"operations": [{"op": "gray")");
       return Recolor(p, {"--edit", p.In("edit.json")});
     }},
    {"EmptyRange", 2, "the range of hues is empty",
     [](Place& p) {
       return Recolor(p, {"--adjust", "hue=20,hues=40:40"});
     }},
    {"ColorInWords", 2, "recolor 'blue'",
     [](Place& p) {
       return Recolor(p, {"--to", "blue"});
     }},
    {"ExposureOutOfRange", 2, "stops must be from -10 to 10",
     [](Place& p) {
       return Recolor(p, {"--exposure", "40"});
     }},
    {"LightnessOfNothing", 2, "--keep-lightness is of --to",
     [](Place& p) {
       return Recolor(p, {"--keep-lightness", "0.5"});
     }},
    {"NoEdit", 2, "there is no edit",
     [](Place& p) {
       return With(p, "refit", {"--masks", p.In("masks"), "--output", p.Out("o.ply")});
     }},
    {"LutCutOff", 3, "film.cube: is not a lookup table",
     [](Place& p) {
       WriteFile(p.in / "film.cube", "LUT_3D_SIZE 3\n0 0 0\n0.5 0 0\n1 0");
       return Recolor(p, {"--lut", p.In("film.cube")});
     }},
    {"LutOfAbsurdSize", 3, "LUT_3D_SIZE 4000000 is not a size",
     [](Place& p) {
       WriteFile(p.in / "film.cube", "LUT_3D_SIZE 4000000\n0 0 0\n");
       return Recolor(p, {"--lut", p.In("film.cube")});
     }},
    {"LutWithNan", 3, "film.cube",
     [](Place& p) {
       WriteFile(p.in / "film.cube", "LUT_1D_SIZE 2\n0 nan 0\n1 1 1\n");
       return Recolor(p, {"--lut", p.In("film.cube")});
     }},
    {"NoLut", 3, "gone.cube: is not a file",
     [](Place& p) {
       return Recolor(p, {"--lut", p.In("gone.cube")});
     }},
    {"PaletteOfTooManyColors", 2, "the number of colors must be from 1 to 16, not 99",
     [](Place& p) {
       return Recolor(p, {"--palette", "99,1=#ff0000"});
     }},
    {"PaletteWithNan", 2, "palette 'nan,1=#ff0000': holds a value that is not finite",
     [](Place& p) {
       return Recolor(p, {"--palette", "nan,1=#ff0000"});
     }},
    {"PaletteOfNothing", 2, "give either --view and --mask, or --masks",
     [](Place& p) {
       return With(p, "palette", {"--picture", p.Out("swatches.png")});
     }},
    {"PaletteOfZeroColors", 2, "--colors",
     [](Place& p) {
       return With(p, "palette", {"--colors", "0", "--masks", p.In("masks")});
     }},
    {"PictureOfAnotherSize", 3, "painted.png is 7x5, the view is 160x120",
     [](Place& p) {
       WritePng(p.in / "painted.png", Image(7, 5));
       return Recolor(p, {"--edited", TinyView() + "=" + p.In("painted.png")});
     }},
    {"PictureThatIsNone", 3, "painted.png",
     [](Place& p) {
       WriteFile(p.in / "painted.png", "no picture");
       return Recolor(p, {"--edited", TinyView() + "=" + p.In("painted.png")});
     }},
    {"PictureOfNoView", 3, "nowhere.png",
     [](Place& p) {
       return Recolor(p, {"--edited", "nowhere.png=" + MaskOf(p).string()});
     }},
    {"PictureWithoutView", 2, "names no view and picture",
     [](Place& p) {
       return Recolor(p, {"--edited", "painted.png"});
     }},
    {"NeitherMaskNorPicture", 2, "--view and --mask are required",
     [](Place& p) {
       return With(p, "recolor", {"--tint", "1,0,0", "--output", p.Out("o.ply")});
     }},
    {"PictureWithoutAChange", 3, "nothing was changed",
     [](Place& p) {
       return With(p, "recolor",
                   {"--edited", TinyView() + "=" + p.In("images/" + TinyView()), "--output",
                    p.Out("o.ply")});
     }},
    {"MaskWithoutView", 2, "--view",
     [](Place& p) {
       Arguments arguments = Recolor(p);
       arguments.insert(arguments.end(), {"--mask", MaskOf(p).string()});
       return arguments;
     }},
    {"ViewTwice", 2, "twice",
     [](Place& p) {
       Arguments arguments = Recolor(p);
       arguments.insert(arguments.end(), {"--view", TinyView(), "--mask", MaskOf(p).string()});
       return arguments;
     }},
    {"UnknownOption", 2, "--frobnicate",
     [](Place& p) {
       return Recolor(p, {"--frobnicate", "1"});
     }},
    {"UnknownVerb", 2, "", [](Place&) { return Arguments{"frobnicate"}; }},
    {"NoVerb", 2, "", [](Place&) { return Arguments{}; }},
    {"RequiredOptionMissing", 2, "--splat", [](Place&) { return Arguments{"recolor"}; }},
    {"NotANumber", 2, "--threads",
     [](Place& p) {
       return Recolor(p, {"--threads", "many"});
     }},
    {"UnknownSolver", 2, "--solver",
     [](Place& p) {
       return Recolor(p, {"--solver", "newton"});
     }},
    {"UnknownBackend", 2, "--backend",
     [](Place& p) {
       return Recolor(p, {"--backend", "abacus"});
     }},
    {"SampleAboveOne", 2, "--sample: must be in (0, 1], not 1.5",
     [](Place& p) {
       return Recolor(p, {"--sample", "1.5"});
     }},
    {"HoldoutOfOne", 2, "--holdout",
     [](Place& p) {
       return Recolor(p, {"--holdout", "1"});
     }},
    {"OutsideWeightOfZero", 2, "--outside-weight: must be in (0, 8], not 0",
     [](Place& p) {
       return Recolor(p, {"--outside-weight", "0"});
     }},
    {"OddDisparities", 2, "--disparities: must be in [16, 1024], a multiple of 16, not 100",
     [](Place& p) {
       return Recolor(p, {"--disparities", "100"});
     }},
    {"NotANumberAtAll", 2, "--tolerance",
     [](Place& p) {
       return Recolor(p, {"--tolerance", "nan"});
     }},
    {"UnknownPresetOfOptions", 2, "--preset",
     [](Place& p) {
       return Recolor(p, {"--preset", "magic"});
     }},
    {"NegativeIterations", 2, "--iterations",
     [](Place& p) {
       return Recolor(p, {"--iterations", "-5"});
     }},
    {"RenderOfNothing", 2, "--view",
     [](Place& p) {
       return With(p, "render", {"--output", p.Out("r")});
     }},
    {"SplatOfUnknownKind", 2, "out.xyz",
     [](Place& p) {
       return Recolor(p, {"--output", p.Out("out.xyz")});
     }},
    {"UnknownPreset", 2, "preset",
     [](Place& p) {
       return Arguments{"synth", "--output", p.Out("ws"), "--preset", "cathedral"};
     }},
    // Outputs that cannot be written.
    {"OutputIsAFolder", 4, "dir.ply",
     [](Place& p) {
       fs::create_directories(p.in / "dir.ply");
       return Recolor(p, {"--output", p.In("dir.ply")});
     }},
    {"OutputBelowAFile", 4, "splat.ply/out.ply",
     [](Place& p) {
       return Recolor(p, {"--output", p.In("splat.ply/out.ply")});
     }},
    {"ReportBelowAFile", 4, "splat.ply/r.json",
     [](Place& p) {
       return Recolor(p, {"--report", p.In("splat.ply/r.json")});
     }},
    {"StagesInPlaceOfAFile", 4, "splat.ply",
     [](Place& p) {
       return Recolor(p, {"--save-stages", p.In("splat.ply")});
     }},
    {"WorkspaceInPlaceOfAFile", 4, "splat.ply",
     [](Place& p) {
       return Arguments{"synth", "--output", p.In("splat.ply")};
     }},
    {"OutputInProc", 4, "/proc/retint/out.ply",
     [](Place& p) {
       return Recolor(p, {"--output", "/proc/retint/out.ply"});
     }},
};

class BadInput : public testing::TestWithParam<Row> {};

// No output, one line, the right code, and the line tells what is wrong.
void ExpectRefused(const CommandResult& result, const Place& place, int code,
                   const std::string& says) {
  EXPECT_EQ(result.code, code) << result.err;
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_EQ(result.err.rfind("retint: ", 0), 0u) << result.err;
  EXPECT_THAT(result.err, testing::HasSubstr(says));
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(FilesBelow(place.out), testing::IsEmpty());
  for (const std::string& name : FilesBelow(place.temp.path())) {
    EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
  }
}

TEST_P(BadInput, IsToldInOneLine) {
  Place place;
  Arguments arguments = GetParam().prepare(place);
  if (!arguments.empty() && arguments[0] != "frobnicate") {
    arguments.insert(arguments.end(), {"--progress", "none"});
  }
  const auto before = FilesBelow(place.temp.path());
  ExpectRefused(RunRetint(arguments), place, GetParam().code, GetParam().says);
  EXPECT_EQ(FilesBelow(place.temp.path()), before);
}

INSTANTIATE_TEST_SUITE_P(Rows, BadInput, testing::ValuesIn(kRows),
                         [](const auto& row) { return std::string(row.param.name); });

TEST(BadInput, AViewThatDoesNotExistGetsTheNearestNames) {
  Place place;
  const CommandResult result = RunRetint(Recolor(place, {"--view", "005.jpg"}));
  ExpectRefused(result, place, 3, "005.png");
  EXPECT_THAT(result.err, testing::HasSubstr("005.jpg"));
}

class FullDisk : public testing::TestWithParam<int> {};

// The limit is met in the splat, in a later picture, or in the report's place in the order.
TEST_P(FullDisk, LeavesWhatWasThere) {
  Place place;
  WriteFile(place.out / "out.ply", "an earlier result");
  CommandOptions options;
  options.max_file_bytes = GetParam();
  Arguments arguments = Recolor(place, {"--iterations", "1"});
  arguments.push_back("--quiet");
  const CommandResult result = RunRetint(arguments, options);
  EXPECT_EQ(result.code, 4) << result.err;
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_THAT(result.err, testing::HasSubstr(place.out.string() + "/out.ply"));
  EXPECT_THAT(result.err, testing::HasSubstr("cannot write"));
  EXPECT_THAT(FilesBelow(place.out), testing::ElementsAre("out.ply"));
  EXPECT_EQ(ReadFile(place.out / "out.ply"), "an earlier result");
}

INSTANTIATE_TEST_SUITE_P(Bytes, FullDisk, testing::Values(0, 1000, 100000, 2000000));

TEST(FullDisk, OfARealFileSystem) {
  TinyWorkspace();  // made here, where nothing is unusual
  const ChildOutcome outcome = RunWithMounts([] {
    Place place;
    ASSERT_EQ(mount("tmpfs", place.out.c_str(), "tmpfs", 0, "size=6m"), 0) << std::strerror(errno);
    // The splat fits, the stages' pictures beside it do not.
    WriteFile(place.out / "ballast", std::string(900000, 'x'));
    Arguments arguments = Recolor(place, {"--iterations", "1"});
    arguments.push_back("--quiet");
    const CommandResult result = RunRetint(arguments);
    const auto left = FilesBelow(place.out);
    umount(place.out.c_str());
    EXPECT_EQ(result.code, 4) << result.err;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_THAT(result.err, testing::HasSubstr("No space left on device"));
    EXPECT_THAT(left, testing::ElementsAre("ballast"));
  });
  if (outcome == ChildOutcome::kNotAllowed) GTEST_SKIP() << "this machine forbids namespaces";
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

TEST(ReadOnly, FolderIsToldBeforeTheWork) {
  TinyWorkspace();
  const ChildOutcome outcome = RunWithMounts([] {
    Place place;
    ASSERT_EQ(mount("tmpfs", place.out.c_str(), "tmpfs", MS_RDONLY, "size=1m"), 0)
        << std::strerror(errno);
    Arguments arguments = Recolor(place);
    arguments.insert(arguments.end(), {"--progress", "json"});
    const CommandResult result = RunRetint(arguments);
    umount(place.out.c_str());
    // The only line: not even loading began.
    ExpectRefused(result, place, 4, place.out.string());
    EXPECT_THAT(result.err, testing::HasSubstr("Read-only file system"));
  });
  if (outcome == ChildOutcome::kNotAllowed) GTEST_SKIP() << "this machine forbids namespaces";
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

}  // namespace
}  // namespace retint
