// SPDX-License-Identifier: BSD-3-Clause
// retint convert: a splat in another format, and the losses.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/run_clock.h"
#include "base/staged_output.h"
#include "base/stopwatch.h"
#include "opening/render_model.h"
#include "opening/virtual_views.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"
#include "scene/sh_band4.h"
#include "splat_io/splat_difference.h"
#include "splat_io/splat_io.h"
#include "splat_io/streamed_sog.h"

namespace retint::cli {
namespace {

struct Arguments {
  std::filesystem::path input, output, report, cameras;
  std::string render_model;
  bool predict = false, drop_bad = false;
};

struct Conversion {
  size_t gaussians = 0;
  int degree_before = 0, degree_after = 0;
  uint64_t bytes_before = 0, bytes_after = 0;
  std::vector<std::string> losses;
  SplatDifference difference;
  std::optional<FormatError> color;
  double milliseconds = 0;
};

std::string Json(const Arguments& arguments, const Conversion& done) {
  const SplatDifference& difference = done.difference;
  nlohmann::ordered_json report;
  report["version"] = Version();
  report["gaussians"] = done.gaussians;
  report["input"] = {{"path", arguments.input.string()},
                     {"bytes", done.bytes_before},
                     {"sh_degree", done.degree_before}};
  report["output"] = {{"path", arguments.output.string()},
                      {"format", CodecForWriting(arguments.output).Name()},
                      {"bytes", done.bytes_after},
                      {"sh_degree", done.degree_after}};
  report["losses"] = done.losses;
  report["difference"] = {
      {"position_max", difference.position_max}, {"position_rms", difference.position_rms},
      {"color_max", difference.color_max},       {"color_rms", difference.color_rms},
      {"opacity_max", difference.opacity_max},   {"scale_ratio_max", difference.scale_ratio_max}};
  if (done.color) {
    report["color_error"] = nlohmann::ordered_json::parse(ToJson(*done.color))["color_error"];
  }
  report["total_ms"] = done.milliseconds;
  report["peak_rss_mb"] = PeakRssMb();
  // A path's name may be bytes that are no text.
  return report.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void Print(const Arguments& arguments, const Conversion& done, const Run& run) {
  const SplatDifference& difference = done.difference;
  constexpr double kMb = 1 << 20;
  run.Print(fmt::format("Gaussians    {}, SH degree {} -> {}", done.gaussians, done.degree_before,
                        done.degree_after));
  run.Print(fmt::format("size         {:.2f} -> {:.2f} MB", double(done.bytes_before) / kMb,
                        double(done.bytes_after) / kMb));
  for (const std::string& loss : done.losses) run.Print("lost         " + loss);
  run.Print(fmt::format("position     {:.2g} at most, {:.2g} RMS, world units",
                        difference.position_max, difference.position_rms));
  run.Print(fmt::format("color        {:.2g} at most, {:.2g} RMS, of [0, 1], seen from 14 sides",
                        difference.color_max, difference.color_rms));
  run.Print(fmt::format("opacity      {:.2g} at most, of [0, 1]", difference.opacity_max));
  run.Print(fmt::format("scale        {:.2g} % at most", 100 * (difference.scale_ratio_max - 1)));
  PrintFormatError(done.color, run);
  for (const auto& path : {arguments.output, arguments.report}) {
    if (!path.empty() && !arguments.predict)
      run.Print(fmt::format("wrote        {}", path.string()));
  }
}

int FileDegree(const GaussianModel& model) { return HasShBand4(model) ? 4 : model.sh_degree; }

// In the views of the workspace; without one, in a few that are placed around the splat. Nothing of
// a splat that no view shows.
std::optional<FormatError> ColorError(const Arguments& arguments, const GaussianModel& model,
                                      const GaussianModel& back, Run& run) {
  SessionOptions options;
  options.backend = run.globals().backend;
  VirtualViewOptions placed;
  placed.views = static_cast<int>(kFormatErrorViews);
  try {
    const auto backend = CreateBackend(options.backend);
    Workspace workspace;
    if (arguments.cameras.empty()) {
      workspace = PlaceViews(backend, model, placed, run.monitor());
    } else {
      workspace = Workspace::Open(arguments.cameras);
      workspace.UndistortViews();
    }
    Renderer renderer(backend, model);
    FormatError error = MeasureFormatError(renderer, back, workspace.reconstruction,
                                           workspace.reconstruction.ViewsByName(), run.monitor());
    error.format = CodecForWriting(arguments.output).Name();
    return error;
  } catch (const std::invalid_argument& error) {
    throw OptionError(std::string("--backend: ") + error.what());
  } catch (const InputError& error) {
    if (!arguments.cameras.empty()) throw;
    run.Warn(std::string("no color error is known: ") + error.what());
    return std::nullopt;
  }
}

void Convert(const Arguments& arguments, Run& run) {
  const Stopwatch stopwatch;
  const SplatCodec& codec = CodecForWriting(arguments.output);
  CheckOutput(arguments.output);
  if (!arguments.report.empty()) CheckOutput(arguments.report);

  GaussianModel model = ReadSplat(arguments.input, run.monitor(),
                                  arguments.drop_bad ? BadRows::kDrop : BadRows::kRefuse);
  CheckStreamedSog(arguments.output, model);
  ChooseRenderModel(ChosenRenderModel(arguments.render_model), arguments.input, {}, model);
  Conversion done;
  done.gaussians = model.NumGaussians();
  done.degree_before = FileDegree(model);
  done.bytes_before = SplatBytes(arguments.input);
  done.losses = model.source.notes;
  for (std::string& loss : codec.Losses(model)) done.losses.push_back(std::move(loss));
  StagedOutput staged;
  staged.Add(arguments.output, [&](const std::filesystem::path& path) {
    codec.Write(path, model, run.monitor());
    const GaussianModel back = codec.Read(path, run.monitor());
    done.degree_after = FileDegree(back);
    done.bytes_after = SplatBytes(path);
    done.difference = Compare(model, back, codec.WriteOrder(model));
    if (codec.Rounds()) done.color = ColorError(arguments, model, back, run);
  });
  done.milliseconds = stopwatch.Milliseconds();
  if (!arguments.report.empty()) {
    staged.Add(arguments.report, [&](const auto& path) { WriteFile(path, Json(arguments, done)); });
  }
  run.monitor().ThrowIfCancelled();
  if (!arguments.predict) run.Commit(staged);
  run.FinishProgress();
  Print(arguments, done, run);
}

}  // namespace

void AddConvert(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "convert",
                           "Write a splat in another format and measure what that loses");
  AddPath(verb, "INPUT", arguments->input, "Splat to read, of any format")->required();
  AddPath(verb, "OUTPUT", arguments->output, "Splat to write; its extension names the format")
      ->required();
  Everyday(verb, AddPath(verb, "--report", arguments->report, "Report to write (.json)"));
  AddPath(verb, "--cameras", arguments->cameras,
          "Workspace in whose views the color error is measured, if the format rounds. Else a few "
          "views are placed around the splat",
          "FOLDER");
  AddRenderModel(verb, arguments->render_model);
  Everyday(verb, verb->add_flag("--predict", arguments->predict,
                                "Only say what the format would lose, and write no splat")
                     ->default_str(""));
  Everyday(verb, verb->add_flag("--drop-bad", arguments->drop_bad,
                                "Leave out Gaussians with a NaN or infinite value, instead of "
                                "refusing the file")
                     ->default_str(""));
  AddExamples(verb, {"retint convert sample/splat.ply small.spz",
                     "retint convert sample/splat.ply small.sog --predict"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Convert(*arguments, run); }; });
}

}  // namespace retint::cli
