// SPDX-License-Identifier: BSD-3-Clause
#include "retint/results.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/run_clock.h"
#include "scene/mask_pixels.h"
#include "splat_io/splat_io.h"

namespace retint::cli {

void PrintParts(const RunReport& report, const Run& run) {
  if (!report.out_of_core) return;
  run.Print(fmt::format("in parts     {} of {} Gaussians, {} of {} views",
                        report.out_of_core->gaussians, report.gaussians, report.out_of_core->views,
                        report.views));
}

void PrintOutputs(const EditOutputs& outputs, const Run& run) {
  std::vector<std::filesystem::path> paths = {outputs.page};
  paths.insert(paths.end(), outputs.splats.begin(), outputs.splats.end());
  for (const auto& path : {outputs.report, outputs.comparison, outputs.stages, outputs.masks,
                           outputs.photos, outputs.views, outputs.session, outputs.finer_splat}) {
    paths.push_back(path);
  }
  std::string line;
  for (const auto& path : paths) {
    if (!path.empty()) line += (line.empty() ? "" : ", ") + path.string();
  }
  run.Print("look at      " + line);
}

void PrintFormatError(const std::optional<FormatError>& error, const Run& run) {
  if (!error) return;
  run.Print(fmt::format("rounding     {}: {}", error->format, DescribeFormatError(*error)));
}

void WarnOfLosses(const std::filesystem::path& output, const GaussianModel& model, Run& run) {
  for (const std::string& loss : CodecForWriting(output).Losses(model)) {
    run.Warn(output.string() + ": " + loss);
  }
}

void WarnOfRefinement(const RefineSummary& summary, const RefineOptions& options, Run& run) {
  const std::string warning = summary.Warning(options);
  if (warning.empty()) return;
  run.Warn(warning + (summary.pixels > options.pixels ? " (--set refine.most)" : ""));
}

std::string Hex(std::span<const float> rgb) {
  std::string text = "#";
  for (const float value : rgb) {
    text += fmt::format("{:02x}", std::lround(std::clamp(value, 0.0F, 1.0F) * 255));
  }
  return text;
}

void PrintSummary(const ColorEdit& edit, const RunReport& report, const std::string& reach,
                  const Run& run) {
  std::string colors;
  for (const ColorOperation& op : edit.operations) {
    if (op.kind != ColorOperationKind::kRecolor || !op.IsSet("from")) continue;
    colors += fmt::format("{} became {}; ", Hex(op.Get("from")), Hex(op.Get("to")));
  }
  run.Print(fmt::format("changed      {}{} of {} Gaussians{}", colors,
                        report.refit.changed_gaussians, report.gaussians,
                        reach.empty() ? "" : "; " + reach));
  const QualityNumbers &fitted = report.quality.train, &heldout = report.quality.heldout;
  const double inside = fitted.psnr_inside_after;
  constexpr double kClose = 35, kRough = 28;  // dB
  const char* const verdict = inside >= kClose   ? "close to the edit"
                              : inside >= kRough ? "near the edit, with visible differences"
                                                 : "far from the edit: look at the page";
  run.Print(fmt::format(
      "quality      {} (inside {:.1f} dB{}); outside {:.1f} dB from the original", verdict, inside,
      heldout.views == 0 ? ""
                         : fmt::format(", {:.1f} dB in views held out", heldout.psnr_inside_after),
      fitted.psnr_outside));
}

void PrintDetails(EditRun& edit, const std::string& reach, const Run& run) {
  EditSession& session = edit.session();
  const RunReport& report = edit.report();
  for (const PaintedReport& view : report.painted) {
    run.Print(fmt::format("{:<12} {} {:.1f} % measured, {} of {} points kept; {}", view.view,
                          view.depth_method, 100 * view.valid_fraction, view.cloud.kept,
                          view.cloud.sampled, view.registration.BriefReport()));
  }
  run.Print(
      fmt::format("selection    {}, {:.2f} % of their pixels", reach, 100 * report.mean_coverage));
  PrintEdit(session.store().regions().regions.front().edit, run);
  if (report.refine) run.Print("refine       " + report.refine->BriefReport());
  run.Print(fmt::format("refit        {}", report.refit.BriefReport()));
  PrintQuality(report.quality, run, &session);
  PrintFormatError(edit.format_error(), run);
  PrintParts(report, run);
  run.Print(fmt::format("time         {:.1f} s, peak memory {:.0f} MB",
                        session.scene().clock().Total() / 1000, PeakRssMb()));
}

void PrintEdit(const ColorEdit& edit, const Run& run) {
  for (const ColorOperation& op : edit.operations) {
    if (op.kind == ColorOperationKind::kRecolor && op.IsSet("from")) {
      run.Print(fmt::format("color        main color {} becomes {}", Hex(op.Get("from")),
                            Hex(op.Get("to"))));
    }
    if (!op.picture) continue;
    run.Print(fmt::format(
        "picture      {} {:.1f} % of the selected pixels (median DeltaE00 {:.2f}){}",
        op.table ? "one color map explains" : "unchanged are", 100 * op.Get("explained")[0],
        op.Get("residual")[0],
        op.picture->layers.empty() ? "" : "; the rest is carried to the other views as paint"));
  }
}

void PrintOutOfGamut(const ColorEdit& edit, const QualityReport& quality, const Run& run) {
  constexpr double kMany = 0.1;
  const bool clips = std::any_of(
      edit.operations.begin(), edit.operations.end(),
      [](const ColorOperation& op) { return op.kind == ColorOperationKind::kSoftClip; });
  if (clips || !(quality.train.out_of_gamut > kMany)) return;
  run.Print(
      fmt::format("out of gamut {:.0f} % of the edited colors; --soft-clip keeps their detail",
                  100 * quality.train.out_of_gamut));
}

void PrintQuality(const QualityReport& quality, const Run& run, const EditSession* session) {
  const std::string rows =
      quality.row_step > 1 ? fmt::format(", in one row of pixels of {}", quality.row_step) : "";
  const auto line = [&](const char* name, const QualityNumbers& numbers, size_t all) {
    if (numbers.views == 0) return;
    const bool some = static_cast<size_t>(numbers.views) < all;
    run.Print(fmt::format(
        "{:<13}{}{} views: inside {:.1f} -> {:.1f} dB, outside {:.1f} dB, "
        "bleed {:.5f}{}",
        name, numbers.views, some ? fmt::format(" of {}", all) : "", numbers.psnr_inside_before,
        numbers.psnr_inside_after, numbers.psnr_outside, numbers.bleed, rows));
  };
  line("fitted", quality.train, session ? session->scene().train_views().size() : 0);
  line("held out", quality.heldout, session ? session->scene().heldout_views().size() : 0);
  run.Print(fmt::format("SH range     [{:.3f}, {:.3f}] -> [{:.3f}, {:.3f}]", quality.sh_before.min,
                        quality.sh_before.max, quality.sh_after.min, quality.sh_after.max));
}

std::optional<PaintAdvice> AdviseOn(EditSession& session, const RegionOutcome& outcome,
                                    Monitor& monitor) {
  if (outcome.confidence.empty() || outcome.refined) return std::nullopt;
  std::vector<std::string> names;
  const RegionSelection& selection = *session.store().Require(outcome.id).selection;
  for (const PaintedView& view : selection.source.painted) names.push_back(view.name);
  return AdvisePaint(session.scene().renderer(), session.scene().reconstruction(),
                     session.scene().pictures().Groups(), names, selection.shares,
                     outcome.confidence, outcome.visible, monitor);
}

void PrintAdvice(const std::optional<PaintAdvice>& advice, const Run& run) {
  if (!advice) return;
  run.Print(fmt::format(
      "next         paint {} to be sure: your paint leaves {:.0f} % of the surroundings open",
      advice->view, 100 * advice->uncertain));
}

}  // namespace retint::cli
