// SPDX-License-Identifier: BSD-3-Clause
// retint synth: a sample workspace with exact ground truth.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "recolor/color_edit.h"
#include "retint/common.h"
#include "synthetic/synthetic_workspace.h"

namespace retint::cli {
namespace {

struct Arguments {
  SyntheticOptions options;
  OptionFlags flags;
  std::filesystem::path output;
  std::vector<std::string> albedo;
  std::string camera_model = "PINHOLE";
};

// OBJECT=#rrggbb or OBJECT=FILE
PaintedObject ParseAlbedo(const std::string& text) {
  const auto fail = [&](const std::string& why) {
    throw OptionError("--albedo '" + text + "': " + why);
  };
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    fail("expected OBJECT=#rrggbb or OBJECT=FILE");
  }
  const std::string object = text.substr(0, equals), value = text.substr(equals + 1);
  if (value[0] != '#') {
    if (!IsFile(value)) fail("'" + value + "' is neither a color, #rrggbb, nor a picture file");
    return {object, {}, ReadImage8(value)};
  }
  constexpr size_t kDigits = 6;
  if (value.size() != 1 + kDigits ||
      value.find_first_not_of("0123456789abcdefABCDEF", 1) != std::string::npos) {
    fail("a color needs six hexadecimal digits after its #");
  }
  const ColorEdit tint = ParseTint(value);
  const auto color = tint.operations.front().Get("color");
  return {object, {color[0], color[1], color[2]}, {}};
}

void Synth(const Arguments& arguments, Run& run) {
  SyntheticOptions options = arguments.options;
  options.seed = run.globals().seed;
  for (const std::string& text : arguments.albedo) options.albedo.push_back(ParseAlbedo(text));
  options.Check();
  CheckOutput(arguments.output, /*as_folder=*/true);
  SyntheticScene scene = MakeSyntheticScene(options, run.monitor());
  if (arguments.camera_model != "PINHOLE") {
    const Camera& pinhole = scene.reconstruction.cameras.begin()->second;
    TakeThroughLens(MakeLens(arguments.camera_model, pinhole), options, &scene, run.monitor());
  }
  SyntheticStart start;
  StagedOutput staged;
  staged.AddFolder(arguments.output, [&](const std::filesystem::path& folder) {
    start = WriteSyntheticWorkspace(folder, scene, run.monitor());
  });
  run.Commit(staged);
  run.FinishProgress();
  const std::string folder = arguments.output.string();
  run.Print(fmt::format("wrote {} views, {} points and {} Gaussians to {}", scene.views.size(),
                        scene.reconstruction.points.size(), scene.model.NumGaussians(), folder));
  run.Print(
      fmt::format("try: retint recolor --workspace {0} --splat {0}/splat.ply --view {1} "
                  "--mask {0}/{2} --tint '#3060ff' --output recolored.ply",
                  folder, start.view, start.mask.string()));
}

}  // namespace

void AddSynth(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "synth", "Make a sample workspace with exact ground truth");
  AddPath(verb, "--output", arguments->output, "Workspace folder to write", "FOLDER")->required();
  OptionList list;
  arguments->options.Describe(list);
  arguments->flags.Add(verb, "Scene", list);
  verb->add_option("--camera-model", arguments->camera_model,
                   "Lens of the photos: PINHOLE, or SIMPLE_RADIAL, OPENCV, OPENCV_FISHEYE or "
                   "EQUIRECTANGULAR, which distort them")
      ->check(CLI::IsMember(
          {"PINHOLE", "SIMPLE_RADIAL", "OPENCV", "OPENCV_FISHEYE", "EQUIRECTANGULAR"}));
  AddRepeated(
      verb, "--albedo", arguments->albedo,
      "Give an object's surface this color (a pattern stays as shades of it), or paste a picture "
      "on every side of its body; repeatable")
      ->type_name("OBJECT=#rrggbb|FILE");
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Synth(*arguments, run); }; });
}

}  // namespace retint::cli
