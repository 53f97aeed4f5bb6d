// SPDX-License-Identifier: BSD-3-Clause
#include "retint/results.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "depth/depth_picture.h"
#include "reporting/report_html.h"
#include "scene/contact_sheet.h"
#include "scene/mask_pixels.h"
#include "splat_io/splat_io.h"

namespace retint::cli {
namespace {

constexpr int kComparisonRows = 4;
constexpr double kComparisonArea = 400 * 300;  // pixels a picture, so that tall ones stay small

const std::map<std::string, Mask>& MasksOf(const Recolored& result) {
  return result.session->store().regions().Find(result.region)->selection->masks;
}

// Painted views first, then views spread evenly over the others that the selection reaches.
std::vector<const View*> ComparisonViews(const Recolored& result) {
  std::vector<const View*> chosen, others;
  const auto is_chosen = [&](const View* view) {
    return std::find(chosen.begin(), chosen.end(), view) != chosen.end();
  };
  for (const PaintedView& painted : result.painted) {
    if (chosen.size() + 1 >= kComparisonRows) break;
    chosen.push_back(result.session->scene().reconstruction().FindView(painted.name));
  }
  for (const View* view : result.session->scene().reconstruction().ViewsByName()) {
    const auto mask = MasksOf(result).find(view->name);
    const bool reached = mask != MasksOf(result).end() && FractionInside(mask->second) > 0.002;
    if (reached && !is_chosen(view)) others.push_back(view);
  }
  const size_t wanted = std::min(kComparisonRows - chosen.size(), others.size());
  for (size_t i = 0; i < wanted; ++i) {
    chosen.push_back(others[(2 * i + 1) * others.size() / (2 * wanted)]);
  }
  return chosen;
}

}  // namespace

void WriteDepth(const std::filesystem::path& map, const std::filesystem::path& picture,
                const DepthEstimate& depth) {
  if (!map.empty()) WriteDepthMap(map, depth.depth);
  if (!picture.empty()) WritePng(picture, DepthPicture(depth.depth, depth.valid));
}

DepthEstimate ComposeDepths(const Pictures& pictures, const UserPicture& picture,
                            const std::map<const View*, DepthEstimate>& depths) {
  if (!picture.photo) return depths.at(picture.faces.front());
  DepthEstimate result;
  std::map<const View*, DepthEstimate> all = depths;
  for (size_t i = 0; i < picture.faces.size(); ++i) {
    const auto found = depths.find(picture.faces[i]);
    if (found != depths.end()) continue;
    const Camera& camera = picture.photo->lens->faces[i].camera;
    DepthEstimate& none = all[picture.faces[i]];
    none.depth = DepthMap(camera.width, camera.height);
    none.valid = Mask(camera.width, camera.height);
  }
  result.depth =
      pictures.ComposeDepth(picture, [&](const View& face) { return all.at(&face).depth; });
  result.valid =
      pictures.ComposeMask(picture, [&](const View& face) { return all.at(&face).valid; });
  for (uint8_t& value : result.valid.data) value = IsInside(value) ? 255 : 0;
  return result;
}

namespace {

// The first painted picture's depth has the fixed name; others go by theirs.
void WriteDepths(const std::filesystem::path& folder, const Recolored& result) {
  const Pictures pictures = result.session->scene().pictures();
  std::map<const View*, DepthEstimate> depths;
  std::vector<const UserPicture*> painted;
  for (size_t i = 0; i < result.selection.depths.size(); ++i) {
    const View* view =
        result.session->scene().reconstruction().FindView(result.selection.painted[i].view);
    depths[view] = result.selection.depths[i];
    const UserPicture* picture = pictures.Showing({view}).front();
    if (std::find(painted.begin(), painted.end(), picture) == painted.end()) {
      painted.push_back(picture);
    }
  }
  for (const UserPicture* picture : painted) {
    const auto base = picture == painted.front() ? folder / "depth"
                                                 : ViewFile(folder / "depth", picture->name, "");
    WriteDepth(base.string() + ".bin", base.string() + ".png",
               ComposeDepths(pictures, *picture, depths));
  }
}

}  // namespace

void WriteStages(const std::filesystem::path& folder, const Recolored& result, Run& run) {
  EditSession& session = *result.session;
  WriteDepths(folder, result);
  WriteCloud(folder / "cloud_raw.ply", result.selection.cloud_raw);
  WriteCloud(folder / "cloud.ply", result.selection.cloud);
  WriteFile(folder / "registration.json", RegistrationsToJson(result.selection.painted));
  session.WriteMasks(folder / "masks", result.region, run.monitor());
  const Pictures pictures = session.scene().pictures();
  const auto& all = pictures.all();
  // What the refit aimed at in every view, then what it reached.
  const auto make = [&](size_t i) -> std::function<void()> {
    const bool aim = i < all.size();
    const UserPicture& shown = all[i % all.size()];
    if (i == 0) session.scene().renderer().SetSh(session.scene().original().sh);
    if (i == all.size()) session.scene().renderer().SetSh(result.sh_after);
    const bool photo = aim && result.target == TargetKind::kPhoto;
    Image picture = pictures.Compose(shown, [&](const View& view) {
      Image drawn =
          photo
              ? session.scene().Picture(view)
              : session.scene().renderer().Render(session.scene().reconstruction().Posed(view)).rgb;
      return aim ? session.refits().Edited(view, std::move(drawn)) : drawn;
    });
    return [path = ViewFile(folder / (aim ? "targets" : "result"), shown.name),
            image = std::move(picture)] { WritePng(path, image); };
  };
  WriteOnAllCores(2 * all.size(), make, run.monitor());
}

Image8 ComparisonPicture(const Recolored& result, Run& run) {
  EditSession& session = *result.session;
  const Pictures pictures = session.scene().pictures();
  const std::map<std::string, Mask>& masks = MasksOf(result);
  std::vector<std::vector<Image8>> rows;
  for (const UserPicture* picture : pictures.Showing(ComparisonViews(result))) {
    run.monitor().ThrowIfCancelled();
    const auto draw = [&](std::span<const float> sh) {
      return pictures.Compose(*picture,
                              [&](const View& view) { return session.scene().Render(view, sh); });
    };
    const Image before = draw(session.scene().original().sh), after = draw(result.sh_after);
    const Mask mask = pictures.ComposeMask(*picture, [&](const View& view) {
      const auto found = masks.find(view.name);
      const Camera& camera = session.scene().reconstruction().Posed(view).camera;
      return found == masks.end() ? Mask(camera.width, camera.height) : found->second;
    });
    rows.push_back({ToImage8(before), MaskOverlay(before, mask), ToImage8(after)});
  }
  const double shape = static_cast<double>(rows[0][0].width) / rows[0][0].height;
  return ContactSheet(rows, std::max(32, static_cast<int>(std::sqrt(kComparisonArea * shape))));
}

void PrintParts(const RunReport& report, const Run& run) {
  if (!report.out_of_core) return;
  run.Print(fmt::format("in parts     {} of {} Gaussians, {} of {} views",
                        report.out_of_core->gaussians, report.gaussians, report.out_of_core->views,
                        report.views));
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
  run.Warn(warning + (summary.pixels > options.pixels ? " (--most-parts)" : ""));
}

void WritePage(const std::filesystem::path& path, EditSession& session, const RunReport& report,
               Run& run) {
  HtmlReportOptions options;
  options.title = "Recoloring of " + session.scene().splat_path().filename().string();
  options.command = run.globals().command;
  options.warnings = run.warnings();
  WriteFile(path, HtmlReport(session, report, options, run.monitor()));
}

std::string Hex(std::span<const float> rgb) {
  std::string text = "#";
  for (const float value : rgb) {
    text += fmt::format("{:02x}", std::lround(std::clamp(value, 0.0F, 1.0F) * 255));
  }
  return text;
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

std::optional<PaintAdvice> AdviseOn(EditSession& session, RegionId region,
                                    const std::vector<PaintedView>& painted,
                                    const ProjectedMasks& masks, Monitor& monitor) {
  if (masks.confidence.empty()) return std::nullopt;
  std::vector<std::string> names;
  for (const PaintedView& view : painted) names.push_back(view.name);
  return AdvisePaint(session.scene().renderer(), session.scene().reconstruction(),
                     session.scene().pictures().Groups(), names,
                     session.store().regions().Find(region)->selection->shares, masks.confidence,
                     masks.visible, monitor);
}

void PrintAdvice(const std::optional<PaintAdvice>& advice, const Run& run) {
  if (!advice) return;
  run.Print(fmt::format(
      "next         paint {} to be sure: your paint leaves {:.0f} % of the surroundings open",
      advice->view, 100 * advice->uncertain));
}

Coverage MeasureCoverage(const std::map<std::string, Mask>& masks) {
  Coverage coverage;
  for (const auto& [name, mask] : masks) {
    const double fraction = FractionInside(mask);
    coverage.views += fraction > 0 ? 1 : 0;
    coverage.mean += fraction / static_cast<double>(masks.size());
  }
  return coverage;
}

}  // namespace retint::cli
