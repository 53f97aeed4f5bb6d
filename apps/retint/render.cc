// SPDX-License-Identifier: BSD-3-Clause
// retint render: views of a splat as pictures.
#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "base/error.h"
#include "base/staged_output.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "depth/depth_picture.h"
#include "retint/common.h"
#include "retint/help.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  LargeArguments large;
  std::vector<std::string> views;
  bool all = false;
  std::filesystem::path output;
  std::vector<std::string> what = {"rgb"};
};

bool Wants(const Arguments& arguments, const char* what) {
  return std::find(arguments.what.begin(), arguments.what.end(), what) != arguments.what.end();
}

void WriteRenders(const Arguments& arguments, const std::filesystem::path& folder,
                  const Pictures& pictures, const UserPicture& picture, EditSession& session) {
  RenderRequest request;
  request.rgb = Wants(arguments, "rgb");
  request.depth_median = Wants(arguments, "depth");
  request.alpha = Wants(arguments, "alpha");
  request.cache = false;
  std::map<const View*, RenderOutput> outputs;
  for (const View* face : picture.faces) {
    outputs[face] =
        session.scene().renderer().Render(session.scene().reconstruction().Posed(*face), request);
  }
  const std::string& name = picture.name;
  if (request.rgb) {
    WritePng(ViewFile(folder, name), pictures.Compose(picture, [&](const View& face) {
      return std::move(outputs[&face].rgb);
    }));
  }
  if (request.depth_median) {
    const DepthMap depth = pictures.ComposeDepth(
        picture, [&](const View& face) { return std::move(outputs[&face].depth_median); });
    WriteDepthMap(ViewFile(folder, name, ".depth.bin"), depth);
    WritePng(ViewFile(folder, name, ".depth.png"), DepthPicture(depth));
  }
  if (request.alpha) {
    const ScalarImage alpha = pictures.ComposeScalar(
        picture, [&](const View& face) { return std::move(outputs[&face].alpha); });
    WritePng(ViewFile(folder, name, ".alpha.png"), alpha);
  }
}

void Render(const Arguments& arguments, Run& run) {
  CheckOption(arguments.all != !arguments.views.empty(),
              "give either --view NAME or --all, and not both");
  const std::string extension = ExtensionOf(arguments.output);
  CheckOption(std::filesystem::is_directory(arguments.output) ||
                  (extension != ".png" && extension != ".jpg" && extension != ".jpeg"),
              arguments.output.string() + ": names a picture, and renders go into a folder");
  CheckOutput(arguments.output, /*as_folder=*/true);
  const auto large = OpenLarge(arguments.scene, arguments.large, 0, /*refit=*/nullptr, run);
  auto session =
      large ? nullptr : OpenSession(arguments.scene, 0, run, arguments.large.Limits(run));
  const Pictures pictures = large ? large->pictures() : session->scene().pictures();
  std::vector<const UserPicture*> views;
  if (arguments.all) {
    for (const UserPicture& picture : pictures.all()) views.push_back(&picture);
  }
  for (const std::string& name : arguments.views) {
    for (const UserPicture* picture : pictures.Require(name)) views.push_back(picture);
  }
  StagedOutput staged;
  staged.AddFolder(arguments.output, [&](const std::filesystem::path& folder) {
    for (size_t i = 0; i < views.size(); ++i) {
      run.monitor().Step("render", static_cast<double>(i), static_cast<double>(views.size()));
      if (large) session = large->Show({views[i]->name}, std::move(session), run.monitor());
      if (large && i == 0) DescribeSession(*session, run.globals().backend, run);
      WriteRenders(arguments, folder, pictures, *views[i], *session);
    }
  });
  run.monitor().Step("render", 1, 1);
  run.Commit(staged);
  run.FinishProgress();
  run.Print(fmt::format("rendered {} views into {}", views.size(), arguments.output.string()));
}

}  // namespace

void AddRender(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "render", "Render views of a splat to PNG");
  AddScene(verb, globals, arguments->scene);
  Everyday(verb, verb->get_option("--splat"));
  Everyday(verb, AddRepeated(verb, "--view", arguments->views, "View to render; repeatable")
                     ->type_name("NAME"));
  Everyday(verb, verb->add_flag("--all", arguments->all, "Render every view"));
  AddPath(verb, "-o,--output", arguments->output,
          "Folder for <image name>.png, .depth.bin and .depth.png, .alpha.png", "FOLDER")
      ->required();
  Everyday(verb, verb->add_option("--what", arguments->what,
                                  "Any of rgb, depth, alpha, separated by commas")
                     ->delimiter(',')
                     ->allow_extra_args(false)
                     ->check(CLI::IsMember({"rgb", "depth", "alpha"})));
  AddLarge(verb, arguments->large, /*selects=*/false);
  AddExamples(verb, {"retint render sample --view 023.png -o pictures",
                     "retint render sample --splat out.ply --all -o after"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Render(*arguments, run); }; });
}

}  // namespace retint::cli
