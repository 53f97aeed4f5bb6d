// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/report.h"
#include "base/run_clock.h"

#include <chrono>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace retint {
namespace {

using nlohmann::json;

PaintedReport Painted(const std::string& view, int used, double rms) {
  PaintedReport report;
  report.view = view;
  report.depth_method = "stereo-hv";
  report.valid_fraction = 0.5;
  report.cloud = {100, 70, 50};
  report.registration.points_used = used;
  report.registration.rms_before = rms;
  report.registration.a = 1.1;
  report.registration.accepted = true;
  report.registration.reason = "converged";
  return report;
}

TEST(Report, HasTheDocumentedKeys) {
  RunReport report;
  report.painted = {Painted("a", 10, 1)};
  const json parsed = json::parse(ToJson(report));
  for (const char* key : {"/version",
                          "/backend",
                          "/gaussians",
                          "/views",
                          "/stages_ms/load",
                          "/stages_ms/depth",
                          "/stages_ms/cloud",
                          "/stages_ms/registration",
                          "/stages_ms/projection",
                          "/stages_ms/refit",
                          "/stages_ms/save",
                          "/stages_ms/total",
                          "/peak_rss_mb",
                          "/peak_device_mb",
                          "/depth/method",
                          "/depth/valid_fraction",
                          "/cloud/mask_pixels",
                          "/cloud/sampled",
                          "/cloud/kept",
                          "/registration/points_used",
                          "/registration/rms_before",
                          "/registration/rms_after",
                          "/registration/heldout_before",
                          "/registration/heldout_after",
                          "/registration/a",
                          "/registration/b",
                          "/registration/scale",
                          "/registration/accepted",
                          "/registration/reason",
                          "/masks/views",
                          "/masks/mean_coverage",
                          "/refit/solver",
                          "/refit/iterations",
                          "/refit/active_gaussians",
                          "/refit/changed_gaussians",
                          "/refit/converged",
                          "/quality/train/psnr_inside_before",
                          "/quality/train/psnr_inside_after",
                          "/quality/train/psnr_outside",
                          "/quality/train/bleed",
                          "/quality/heldout/psnr_inside_before",
                          "/quality/heldout/bleed",
                          "/sh_range/before",
                          "/sh_range/after"}) {
    EXPECT_TRUE(parsed.contains(json::json_pointer(key))) << key;
  }
  EXPECT_EQ(parsed["cloud"]["kept"], 50);
  EXPECT_EQ(parsed["registration"]["a"], 1.1);
}

TEST(Report, HoldsTheOptionsAndTheFiguresByTrueMasks) {
  RunReport report;
  report.options = {{"solver", "", std::string("mm")}, {"tolerance", "mm", 0.5}};
  json parsed = json::parse(ToJson(report));
  EXPECT_EQ(parsed["options"]["solver"], "mm");
  EXPECT_EQ(parsed["options"]["mm"]["tolerance"], 0.5);
  EXPECT_FALSE(parsed.contains("true_masks"));
  report.true_masks.emplace();
  report.true_masks->mask_iou = 0.75;
  report.true_masks->quality.train.views = 3;
  report.true_masks->quality.train.psnr_outside = 41;
  parsed = json::parse(ToJson(report));
  EXPECT_EQ(parsed["true_masks"]["quality"]["train"]["psnr_outside"], 41);
  EXPECT_EQ(parsed["true_masks"]["mask_iou"], 0.75);
  EXPECT_TRUE(parsed["quality"]["train"]["psnr_outside"].is_null());
}

TEST(Report, FiguresThatDoNotExistAreNull) {
  RunReport report;
  report.mean_coverage = std::numeric_limits<double>::quiet_NaN();
  report.quality.train.views = 2;
  report.quality.train.psnr_inside_after = 30;
  const json parsed = json::parse(ToJson(report));
  EXPECT_TRUE(parsed["masks"]["mean_coverage"].is_null());
  EXPECT_TRUE(parsed["quality"]["heldout"]["bleed"].is_null());
  EXPECT_TRUE(parsed["depth"]["method"].is_null());
  EXPECT_EQ(parsed["quality"]["train"]["psnr_inside_after"], 30);
}

TEST(Report, PoolsSeveralPaintedViews) {
  RunReport report;
  report.painted = {Painted("a", 30, 1), Painted("b", 10, 3)};
  report.painted[1].registration.accepted = false;
  report.painted[1].registration.a = 1;
  const json parsed = json::parse(ToJson(report));
  EXPECT_EQ(parsed["cloud"]["kept"], 100);
  EXPECT_EQ(parsed["registration"]["points_used"], 40);
  // Root of (30 * 1 + 10 * 9) / 40.
  EXPECT_NEAR(parsed["registration"]["rms_before"].get<double>(), std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(parsed["registration"]["a"].get<double>(), 1.05, 1e-12);
  EXPECT_EQ(parsed["registration"]["accepted"], false);
  EXPECT_EQ(parsed["painted"].size(), 2u);
}

TEST(Report, SurvivesNamesThatAreNotUtf8) {
  RunReport report;
  report.painted = {Painted("caf\xe9.jpg", 1, 1)};
  EXPECT_NO_THROW(json::parse(ToJson(report)));
  EXPECT_NO_THROW(json::parse(RegistrationsToJson(report.painted)));
}

TEST(StageClock, SumsVisitsAndStartsAtZero) {
  static std::chrono::milliseconds now{0};
  StageClock clock([] { return std::chrono::steady_clock::time_point(now); });
  EXPECT_EQ(clock.Get("depth"), 0);
  for (const int visit : {2, 3}) {
    const StageClock::Lap lap(clock, "depth");
    now += std::chrono::milliseconds(visit);
  }
  now += std::chrono::milliseconds(10);
  EXPECT_EQ(clock.Get("depth"), 5);
  EXPECT_EQ(clock.Total(), 15);
}

TEST(PeakRss, IsThatOfAProcess) {
  EXPECT_GT(PeakRssMb(), 1);
  EXPECT_LT(PeakRssMb(), 1 << 20);
}

}  // namespace
}  // namespace retint
