// SPDX-License-Identifier: BSD-3-Clause
// retint depth: the depth map of one view.
#include <map>

#include <fmt/format.h>

#include "base/error.h"
#include "base/staged_output.h"
#include "depth/sparse_errors.h"
#include "pipeline/edit_outputs.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  LargeArguments large;
  std::string view, against = "none";
  std::filesystem::path output, png;
};

void PrintErrors(const SparseErrors& errors, Run& run) {
  run.Print(fmt::format("sparse points: {} seen, {} of them where the map has a depth",
                        errors.points, errors.compared));
  if (errors.compared == 0) return;
  run.Print(fmt::format("  error       median {:.2f} %, 90 % up to {:.2f} % of the depth",
                        100 * errors.median, 100 * errors.ninety));
  run.Print(fmt::format("  in length   median {:.4g}, 90 % up to {:.4g} in the workspace's unit",
                        errors.median_length, errors.ninety_length));
  run.Print(
      fmt::format("  bias        {:+.2f} %, positive where the map is too far", 100 * errors.bias));
}

void Depth(const Arguments& arguments, Run& run) {
  const SelectOptions options = Resolve(arguments.edit, run.globals()).select;
  CheckOption(!arguments.output.empty() || !arguments.png.empty() || arguments.against != "none",
              "there is nothing to write or to compare with: give --output, --png or --against");
  if (!arguments.output.empty()) CheckOutput(arguments.output);
  if (!arguments.png.empty()) CheckPicture(arguments.png);
  const auto large = OpenLarge(arguments.scene, arguments.large, 0, /*refit=*/nullptr, run);
  auto session = large ? large->Show({arguments.view}, nullptr, run.monitor())
                       : OpenSession(arguments.scene, 0, run, arguments.large.Limits(run));
  if (large) DescribeSession(*session, run.globals().backend, run);
  const Pictures pictures = session->scene().pictures();
  const auto found = pictures.Require(arguments.view);
  if (found.size() > 1) {
    throw OptionError(arguments.view + " is shown by " + std::to_string(found.size()) +
                      " views: name one of them, such as " + found.front()->name);
  }
  const UserPicture& picture = *found.front();
  if (large) {
    std::vector<PosedCamera> cameras;
    for (const View* view : picture.faces) {
      cameras.push_back(session->scene().reconstruction().Posed(*view));
    }
    session = large->ForDepth(cameras, options, std::move(session), run.monitor());
  }
  std::map<const View*, DepthEstimate> depths;
  for (const View* view : picture.faces) {
    depths[view] = session->selection().EstimateDepth(
        session->scene().reconstruction().Posed(*view), options, run.monitor());
  }
  const DepthEstimate depth = ComposeDepths(pictures, picture, depths);
  StagedOutput staged;
  if (!arguments.output.empty()) {
    staged.Add(arguments.output, [&](const auto& path) { WriteDepth(path, {}, depth); });
  }
  if (!arguments.png.empty()) {
    staged.Add(arguments.png, [&](const auto& path) { WriteDepth({}, path, depth); });
  }
  run.monitor().ThrowIfCancelled();
  run.Commit(staged);
  run.FinishProgress();
  for (const View* view : picture.faces) {
    const DepthEstimate& one = depths[view];
    if (picture.faces.size() > 1) run.Print(view->name);
    if (!one.warning.empty()) run.Warn(one.warning);
    run.Print(fmt::format("{}: {:.1f} % of the pixels measured ({})", one.method,
                          100 * one.valid_fraction, one.reason));
    if (arguments.against == "sparse") {
      PrintErrors(CompareWithSparse(one.depth, session->scene().reconstruction(), *view), run);
    }
  }
}

}  // namespace

void AddDepth(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "depth", "Estimate the depth of one view");
  AddScene(verb, globals, arguments->scene);
  verb->add_option("--view", arguments->view, "Name of the view")->required()->type_name("NAME");
  Everyday(verb, AddPath(verb, "-o,--output", arguments->output,
                         "COLMAP depth map (.bin) to write, z in the workspace's unit, 0 unknown"));
  Everyday(verb,
           AddPath(verb, "--png", arguments->png, "Picture to write: near is warm, far is cold"));
  Everyday(verb, verb->add_option("--against", arguments->against,
                                  "Print the errors against the sparse points of the view, or none")
                     ->check(CLI::IsMember({"none", "sparse"})));
  AddPreset(verb, arguments->edit);
  AddDepthOptions(verb, arguments->edit);
  Everyday(verb, verb->get_option("--depth-method"));
  AddLarge(verb, arguments->large, /*selects=*/false);
  AddExamples(verb, {"retint depth sample --view 023.png --png depth.png --against sparse"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Depth(*arguments, run); }; });
}

}  // namespace retint::cli
