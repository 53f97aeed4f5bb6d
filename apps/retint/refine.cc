// SPDX-License-Identifier: BSD-3-Clause
// retint refine: a splat whose Gaussians are fine enough inside masks to show paint.
#include <fmt/format.h>

#include "base/error.h"
#include "base/staged_output.h"
#include "editing/region_store.h"
#include "recolor/finer_gaussians.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"
#include "selecting/selection_files.h"
#include "splat_io/splat_io.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  RefineOptions options;
  OptionFlags flags;
  MaskArguments masks;
  std::filesystem::path output;
};

void Refine(const Arguments& arguments, Run& run) {
  arguments.options.Check();
  const SplatCodec& codec = CodecForWriting(arguments.output);
  CheckOutput(arguments.output);
  const auto session = OpenSession(arguments.scene, 0, run);
  const Pictures pictures = session->scene().pictures();
  MaskFolder folder = ReadMasksByName(arguments.masks, pictures, run);
  SharesOfMasks shares = ReadShares(arguments.masks.folder, folder.checksum,
                                    session->scene().original().NumGaussians());
  if (!shares.why_not.empty()) run.Warn(shares.why_not);
  const std::map<std::string, Mask> masks =
      std::move(folder).OfViews(pictures, session->scene().views());
  const Refinement refined = RefineGaussians(
      session->scene().renderer(), session->scene().original(),
      RenderTargets(session->scene().reconstruction(), masks, session->scene().views()),
      std::move(shares.shares), arguments.options, run.monitor());
  const RefineSummary& summary = refined.summary;
  WarnOfRefinement(summary, arguments.options, run);
  StagedOutput staged;
  staged.Add(arguments.output, [&](const std::filesystem::path& path) {
    codec.Write(path, refined.finer.model, run.monitor());
  });
  run.Commit(staged);
  WarnOfLosses(arguments.output, refined.finer.model, run);
  run.FinishProgress();
  run.Print("refine       " + summary.BriefReport());
  run.Print(fmt::format("wrote        {}", arguments.output.string()));
}

}  // namespace

void AddRefine(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "refine",
                           "Split large Gaussians inside masks, for fine stripes and letters");
  AddScene(verb, globals, arguments->scene);
  AddMasks(verb, arguments->masks)->required();
  AddPath(verb, "-o,--output", arguments->output, "Splat to write, in the format of its extension")
      ->required();
  OptionList list;
  arguments->options.Describe(list);
  arguments->flags.Add(verb, "refine", kOtherOptions, list);
  Everyday(verb, verb->get_option("--set"));
  AddExamples(verb, {"retint refine sample --masks sample/truth/masks/box -o finer.ply",
                     "retint refine sample --masks sample/truth/masks/box -o finer.ply "
                     "--set refine.pixels=2"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Refine(*arguments, run); }; });
}

}  // namespace retint::cli
