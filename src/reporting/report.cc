// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/report.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "base/option_json.h"
#include "base/run_clock.h"
#include "recolor/edit_text.h"

namespace retint {
namespace {

using Json = nlohmann::ordered_json;

Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json Joined(const std::vector<std::string>& texts) {
  std::string joined;
  for (const std::string& text : texts) {
    if (joined.find(text) != std::string::npos) continue;
    joined += (joined.empty() ? "" : "; ") + text;
  }
  return joined;
}

Json DepthJson(const std::vector<PaintedReport>& painted) {
  if (painted.empty()) return {{"method", nullptr}, {"valid_fraction", nullptr}};
  double valid = 0;
  for (const PaintedReport& view : painted) valid += view.valid_fraction;
  return {{"method", painted.front().depth_method},
          {"valid_fraction", Number(valid / static_cast<double>(painted.size()))}};
}

Json CloudJson(const std::vector<PaintedReport>& painted) {
  CloudSummary sum;
  for (const PaintedReport& view : painted) {
    sum.mask_pixels += view.cloud.mask_pixels;
    sum.sampled += view.cloud.sampled;
    sum.kept += view.cloud.kept;
  }
  return {{"mask_pixels", sum.mask_pixels}, {"sampled", sum.sampled}, {"kept", sum.kept}};
}

Json RegistrationJson(const RegistrationSummary& summary) {
  return {{"points_used", summary.points_used},
          {"rms_before", Number(summary.rms_before)},
          {"rms_after", Number(summary.rms_after)},
          {"heldout_before", Number(summary.heldout_before)},
          {"heldout_after", Number(summary.heldout_after)},
          {"a", Number(summary.a)},
          {"b", Number(summary.b)},
          {"scale", Number(summary.world_from_cloud.scale)},
          {"accepted", summary.accepted},
          {"reason", summary.reason}};
}

Json RefineJson(const RefineSummary& refine) {
  return {{"split", refine.split},
          {"parts", refine.parts},
          {"part_pixels", Number(refine.pixels)},
          {"psnr_split", Number(refine.psnr_split)},
          {"psnr", Number(refine.psnr)}};
}

// Root of the mean square over several views' points.
class PooledRms {
 public:
  void Add(double rms, int count) {
    sum_ += rms * rms * count;
    count_ += count;
  }
  double Get() const { return count_ > 0 ? std::sqrt(sum_ / count_) : 0; }

 private:
  double sum_ = 0;
  int count_ = 0;
};

Json PooledRegistrationJson(const std::vector<PaintedReport>& painted) {
  if (painted.empty()) {
    RegistrationSummary none;
    none.reason = "not run";
    return RegistrationJson(none);
  }
  if (painted.size() == 1) return RegistrationJson(painted.front().registration);
  RegistrationSummary all;
  PooledRms before, after, heldout_before, heldout_after;
  std::vector<std::string> reasons;
  all.a = all.b = all.world_from_cloud.scale = 0;
  all.accepted = true;
  const double share = 1.0 / static_cast<double>(painted.size());
  for (const PaintedReport& view : painted) {
    const RegistrationSummary& one = view.registration;
    all.points_used += one.points_used;
    before.Add(one.rms_before, one.points_used);
    after.Add(one.rms_after, one.points_used);
    heldout_before.Add(one.heldout_before, one.points_heldout);
    heldout_after.Add(one.heldout_after, one.points_heldout);
    all.a += share * one.a;
    all.b += share * one.b;
    all.world_from_cloud.scale += share * one.world_from_cloud.scale;
    all.accepted = all.accepted && one.accepted;
    reasons.push_back(view.view + ": " + one.reason);
  }
  all.rms_before = before.Get();
  all.rms_after = after.Get();
  all.heldout_before = heldout_before.Get();
  all.heldout_after = heldout_after.Get();
  all.reason = Joined(reasons);
  return RegistrationJson(all);
}

Json PaintedJson(const PaintedReport& view) {
  return {{"view", view.view},
          {"outlined_by", view.outlined_by.empty() ? Json() : Json(view.outlined_by)},
          {"depth",
           {{"method", view.depth_method},
            {"valid_fraction", Number(view.valid_fraction)},
            {"reason", view.depth_reason}}},
          {"cloud",
           {{"mask_pixels", view.cloud.mask_pixels},
            {"sampled", view.cloud.sampled},
            {"kept", view.cloud.kept}}},
          {"registration", RegistrationJson(view.registration)}};
}

Json QualityJson(const QualityNumbers& numbers) {
  const bool any = numbers.views > 0;
  const auto figure = [&](double value) { return any ? Number(value) : Json(nullptr); };
  return {{"views", numbers.views},
          {"psnr_inside_before", figure(numbers.psnr_inside_before)},
          {"psnr_inside_after", figure(numbers.psnr_inside_after)},
          {"psnr_outside", figure(numbers.psnr_outside)},
          {"bleed", figure(numbers.bleed)},
          {"out_of_gamut", figure(numbers.out_of_gamut)}};
}

Json EditJson(const ColorEdit& edit) {
  return Json::parse(EditToJson(edit, /*with_tables=*/false));
}

Json RangeJson(const ShRange& range) { return Json::array({range.min, range.max}); }

Json WorstJson(const std::vector<ViewQuality>& worst) {
  Json list = Json::array();
  for (const ViewQuality& view : worst) {
    list.push_back({{"view", view.name},
                    {"heldout", view.heldout},
                    {"coverage", Number(view.coverage)},
                    {"psnr_inside", Number(view.psnr_inside)},
                    {"psnr_outside", Number(view.psnr_outside)}});
  }
  return list;
}

Json ReportJson(const QualityReport& quality) {
  return {{"train", QualityJson(quality.train)},
          {"heldout", QualityJson(quality.heldout)},
          {"worst", WorstJson(quality.worst)}};
}

}  // namespace

std::string ToJson(const RunReport& report) {
  Json stages;
  for (const char* stage : {"load", "depth", "cloud", "registration", "projection", "refine",
                            "refit", "save", "total"}) {
    const auto found = report.stages_ms.find(stage);
    stages[stage] = found == report.stages_ms.end() ? 0.0 : found->second;
  }
  Json painted = Json::array();
  for (const PaintedReport& view : report.painted) painted.push_back(PaintedJson(view));
  Json regions = Json::array();
  for (const RegionReport& region : report.regions) {
    regions.push_back({{"name", region.name},
                       {"edit", EditJson(region.edit)},
                       {"quality", ReportJson(region.quality)}});
    if (region.refine) regions.back()["refine"] = RefineJson(*region.refine);
  }
  Json json = {
      {"version", Version()},
      {"backend", report.backend},
      {"ranks", report.ranks},
      {"sent_mb", Number(report.sent_mb)},
      {"exchange", report.exchange.empty() ? Json() : Json(report.exchange)},
      {"gaussians", report.gaussians},
      {"views", report.views},
      {"stages_ms", stages},
      {"peak_rss_mb", Number(report.peak_rss_mb)},
      {"peak_device_mb", Number(report.peak_device_mb)},
      {"options", json::OptionsJson(report.options)},
      {"depth", DepthJson(report.painted)},
      {"cloud", CloudJson(report.painted)},
      {"registration", PooledRegistrationJson(report.painted)},
      {"painted", painted},
      {"edit", report.edit ? EditJson(*report.edit) : Json()},
      {"masks", {{"views", report.mask_views}, {"mean_coverage", Number(report.mean_coverage)}}},
      {"refit",
       {{"solver", report.refit.solver},
        {"iterations", report.refit.iterations},
        {"active_gaussians", report.refit.active_gaussians},
        {"changed_gaussians", report.refit.changed_gaussians},
        {"converged", report.refit.converged},
        {"reason", report.refit.reason}}},
      {"quality", ReportJson(report.quality)},
      {"sh_range",
       {{"before", RangeJson(report.quality.sh_before)},
        {"after", RangeJson(report.quality.sh_after)}}},
  };
  if (report.refine) json["refine"] = RefineJson(*report.refine);
  if (report.true_masks) {
    json["true_masks"] = {{"mask_iou", Number(report.true_masks->mask_iou)},
                          {"quality", ReportJson(report.true_masks->quality)}};
  }
  if (report.out_of_core) {
    const OutOfCoreReport& part = *report.out_of_core;
    json["out_of_core"] = {{"gaussians", part.gaussians},
                           {"blocks", part.blocks},
                           {"all_blocks", part.all_blocks},
                           {"views", part.views},
                           {"memory_limit_mb", Number(part.memory_limit_mb)},
                           {"device_limit_mb", Number(part.device_limit_mb)},
                           {"index_ms", Number(part.index_ms)}};
  }
  if (!report.regions.empty()) json["regions"] = std::move(regions);
  // Names of views are bytes of a file; ones that are not UTF-8 must not end a finished run.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string RegistrationsToJson(const std::vector<PaintedReport>& painted) {
  Json list = Json::array();
  for (const PaintedReport& view : painted) {
    Json one = {{"view", view.view}};
    one.update(RegistrationJson(view.registration));
    const auto& moved = view.registration.world_from_cloud;
    one["rotation_wxyz"] = {moved.rotation.w(), moved.rotation.x(), moved.rotation.y(),
                            moved.rotation.z()};
    one["translation"] = {moved.translation.x(), moved.translation.y(), moved.translation.z()};
    one["points_heldout"] = view.registration.points_heldout;
    list.push_back(one);
  }
  return list.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace retint
