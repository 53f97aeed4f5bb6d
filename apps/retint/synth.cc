// SPDX-License-Identifier: BSD-3-Clause
// retint synth: a sample workspace with exact ground truth.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "recolor/color_name.h"
#include "retint/common.h"
#include "retint/help.h"
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

// OBJECT=COLOR or OBJECT=FILE
PaintedObject ParseAlbedo(const std::string& text) {
  const auto fail = [&](const std::string& why) {
    throw OptionError("--albedo '" + text + "': " + why);
  };
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    fail("expected OBJECT=COLOR or OBJECT=FILE");
  }
  const std::string object = text.substr(0, equals), value = text.substr(equals + 1);
  if (IsFile(value)) return {object, {}, ReadImage8(value)};
  std::array<float, 3> color{};
  const std::string fault = ReadColor(value, &color);
  if (!fault.empty())
    fail(value[0] == '#' ? fault : "'" + value + "' is neither a color nor a picture file");
  return {object, color, {}};
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
      fmt::format("try: retint recolor {0} --view {1} --mask {0}/{2} --to '#3060ff' -o out.ply",
                  folder, start.view, start.mask.string()));
}

}  // namespace

void AddSynth(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "synth", "Make a sample workspace with exact ground truth");
  AddPath(verb, "-o,--output", arguments->output, "Workspace folder to write", "FOLDER")
      ->required();
  OptionList list;
  arguments->options.Describe(list);
  arguments->flags.Add(verb, "synth", kSceneGroup, list);
  verb->add_option("--camera-model", arguments->camera_model,
                   "Lens of the photos. All but PINHOLE distort them")
      ->check(CLI::IsMember(
          {"PINHOLE", "SIMPLE_RADIAL", "OPENCV", "OPENCV_FISHEYE", "EQUIRECTANGULAR"}));
  AddRepeated(verb, "--albedo", arguments->albedo,
              "Color of an object, of which a pattern becomes shades. Or a picture to paste on "
              "every side of it; repeatable")
      ->type_name("OBJECT=COLOR|FILE");
  AddExamples(verb, {"retint synth -o sample", "retint synth -o around --around --photos 24"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Synth(*arguments, run); }; });
}

}  // namespace retint::cli
