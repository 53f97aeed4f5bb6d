// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/report_html.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "reporting/export.h"
#include "reporting/report_plots.h"
#include "scene/mask_pixels.h"
#include "tests/saving/saved_scene.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::Not;

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(HtmlText, HidesWhatHtmlReads) {
  EXPECT_EQ(HtmlText("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
  EXPECT_EQ(HtmlText("\xC3\xBC\xFF!"), "\xC3\xBC\xEF\xBF\xBD!");
  EXPECT_EQ(HtmlText("\xE2\x82"), "\xEF\xBF\xBD\xEF\xBF\xBD");  // cut off
}

TEST(BarPlot, HasABarForEachFiniteValue) {
  const std::string svg =
      BarPlot({{"a", 10, false}, {"b", 20, true}, {"c", NAN, false}}, "dB", "PSNR", "held out");
  EXPECT_EQ(Count(svg, "<rect"), 2);
  EXPECT_THAT(svg, HasSubstr("b (held out): 20.0 dB"));
  EXPECT_EQ(BarPlot({}, "dB", "PSNR", ""), "");
}

TEST(LogLinePlot, NeedsTwoPositiveValues) {
  EXPECT_EQ(LogLinePlot({1}, "sweeps", "loss"), "");
  EXPECT_EQ(LogLinePlot({1, 0, -1}, "sweeps", "loss"), "");
  EXPECT_THAT(LogLinePlot({1, 0.1}, "sweeps", "loss"), HasSubstr("<polyline"));
}

class Html : public testing::Test {
 protected:
  Html() { EditTinyScene(scene_, *session_); }
  std::string Make(const HtmlReportOptions& options = {}) {
    const RunReport report = FullReport(*session_, TargetKind::kRender, monitor_);
    return HtmlReport(*session_, report, options, monitor_);
  }

  const TinyScene scene_{51};
  Monitor monitor_;
  std::unique_ptr<EditSession> session_ = MakeSession(scene_);
};

TEST_F(Html, IsOnePageWithEveryView) {
  HtmlReportOptions options;
  options.title = "A <title>";
  options.command = "retint recolor --tint '#ff0000'";
  options.warnings = {"Something is odd & new"};
  const std::string page = Make(options);
  for (const View* view : session_->scene().reconstruction().ViewsByName()) {
    EXPECT_THAT(page, HasSubstr("Before and after of " + view->name));
  }
  const auto views = static_cast<int>(session_->scene().reconstruction().views.size());
  EXPECT_EQ(Count(page, " before\""), views);
  EXPECT_EQ(Count(page, " after\""), views);
  EXPECT_GE(Count(page, " mask\""), 6);
  EXPECT_THAT(page, HasSubstr("<h1>A &lt;title&gt;</h1>"));
  EXPECT_THAT(page, HasSubstr("Something is odd &amp; new"));
  EXPECT_THAT(page, HasSubstr("--tint &#39;#ff0000&#39;"));
  EXPECT_THAT(page, HasSubstr("right"));  // a region's name
  EXPECT_THAT(page, Not(HasSubstr("http"))) << "it needs no network";
  EXPECT_THAT(page, Not(HasSubstr("src=\"file")));
}

// The slider begins in the middle of the masks, where both sides show a part of the change.
TEST_F(Html, LabelsBothSidesAndBeginsInTheChange) {
  const std::string page = Make();
  const auto views = static_cast<int>(session_->scene().reconstruction().views.size());
  EXPECT_EQ(Count(page, ">before</div>"), views);
  EXPECT_EQ(Count(page, ">after</div>"), views);
  const RegionSet& set = session_->store().regions();
  std::vector<size_t> sums;  // of the columns of the first view's masks
  size_t all = 0;
  const std::string name = ViewName(0);
  for (const Region& region : set.regions) {
    const auto mask = region.selection->masks.find(name);
    if (!region.visible || mask == region.selection->masks.end()) continue;
    sums.resize(static_cast<size_t>(mask->second.width));
    for (size_t i = 0; i < mask->second.data.size(); ++i) {
      sums[i % sums.size()] += mask->second.data[i];
      all += mask->second.data[i];
    }
  }
  ASSERT_GT(all, 0u);
  const size_t at = page.find("value=\"", page.find("alt=\"" + HtmlText(name) + " after\""));
  const size_t percent = std::stoul(page.substr(at + 7));
  size_t left = 0;
  for (size_t x = 0; x < sums.size() * percent / 100; ++x) left += sums[x];
  EXPECT_NEAR(double(left) / double(all), 0.5, 0.15);  // a column and masks that overlap
  EXPECT_THAT(page, HasSubstr("--at: " + std::to_string(percent) + "%"));
}

// In words and as a picture, but for a free view, which has no mask.
TEST_F(Html, ShowsWhatBecameOfThePaint) {
  const std::string page = Make();
  EXPECT_EQ(Count(page, "<h2>Paint of "), 1) << "the other region was not painted";
  EXPECT_THAT(page, HasSubstr("<h2>Paint of left &quot;100 %"));
  EXPECT_THAT(page, HasSubstr("of your paint is in"));
  EXPECT_EQ(Count(page, " paint\" src=\"data:image/jpeg"), 1);
  EXPECT_THAT(page, HasSubstr("alt=\"" + HtmlText(ViewName(0)) + " paint\""));
}

TEST_F(Html, TheWorstViewComesFirst) {
  const RunReport report = FullReport(*session_, TargetKind::kRender, monitor_);
  std::string worst;
  double least = 1000;
  for (const RegionReport& region : report.regions) {
    for (const ViewQuality& view : region.quality.views) {
      if (view.psnr_inside < least) worst = view.name;
      least = std::min(least, view.psnr_inside);
    }
  }
  const std::string page = HtmlReport(*session_, report, {}, monitor_);
  const auto first = page.find("Before and after of ");
  EXPECT_EQ(page.substr(first + 20, worst.size()), worst);
}

// Whose they are, and how much all of them select together.
TEST_F(Html, FiguresOfSeveralRegionsSayWhoseTheyAre) {
  const RunReport report = FullReport(*session_, TargetKind::kRender, monitor_);
  ASSERT_EQ(report.regions.size(), 2U);
  const std::string page = HtmlReport(*session_, report, {}, monitor_);
  for (const RegionReport& region : report.regions) {
    EXPECT_THAT(page, HasSubstr("<dt>inside, " + HtmlText(region.name) + ", fitted views</dt>"));
  }
  const auto left = MasksOf(scene_), right = OtherMasksOf(scene_);
  for (const ViewQuality& view : report.regions[0].quality.views) {
    const auto& other = report.regions[1].quality.views;
    const auto same = std::ranges::find(other, view.name, &ViewQuality::name);
    if (same == other.end()) continue;
    const bool is_left = view.psnr_inside <= same->psnr_inside;
    const ViewQuality& worst = is_left ? view : *same;
    Mask both = left.at(view.name);
    const Mask& second = right.at(view.name);
    for (size_t i = 0; i < both.data.size(); ++i) {
      both.data[i] = std::max(both.data[i], second.data[i]);
    }
    EXPECT_THAT(page, HasSubstr(fmt::format(
                          "inside {:.1f} dB ({}), outside {:.1f} dB, {:.1f} % selected",
                          worst.psnr_inside, HtmlText(report.regions[is_left ? 0 : 1].name),
                          worst.psnr_outside, 100 * FractionInside(both))));
  }
}

TEST_F(Html, StaysWithinItsSize) {
  const size_t whole = Make().size();
  HtmlReportOptions options;
  options.most_bytes = whole - 1;  // tiny pictures cannot shrink, only get coarser
  EXPECT_LE(Make(options).size(), options.most_bytes);
  options.most_bytes = 1000;
  EXPECT_THROW(Make(options), RunError);
}

// Small Gaussians of any color: pictures of noise, which hardly shrink as JPEGs.
GaussianModel Noise(int count) {
  TestRandom random(7);
  GaussianModel model;
  model.Resize(size_t(count), 0);
  for (size_t g = 0; g < size_t(count); ++g) {
    const Eigen::Vector3d mean(random.Uniform(-1, 1), random.Uniform(-1, 1),
                               random.Uniform(-0.3, 0.3));
    SetGaussian(model, g, mean, random.Uniform(0.005, 0.015), 4);
    for (size_t c = 0; c < 3; ++c) model.sh[3 * g + c] = float(random.Uniform(-1.7, 1.7));
  }
  return model;
}

TEST(HtmlReport, TwoHundredViewsStayBelowTenMegabytes) {
  Workspace workspace;
  workspace.root = "noise";
  workspace.reconstruction.cameras[1] = Camera::Pinhole(1, 320, 240, 500, 500, 160, 120);
  for (uint32_t i = 1; i <= 200; ++i) {
    View view;
    view.id = i;
    view.name = ViewName(i);
    view.camera_id = 1;
    view.cam_from_world = LookAtOrigin(0.002 * i, 4).cam_from_world;
    workspace.reconstruction.views[i] = view;
  }
  SessionOptions options;
  options.backend = "cpu";
  EditSession session(std::move(workspace), Noise(6000), options);
  Monitor monitor;
  const std::string page = HtmlReport(session, MakeReport(session), {}, monitor);
  EXPECT_EQ(Count(page, "Before and after of "), 200);
  EXPECT_LE(page.size(), 10'000'000u);
  // The pictures fill the limit; otherwise this would test nothing.
  EXPECT_GE(page.size(), 3'000'000u);
}

TEST_F(Html, CanBeCancelled) {
  const RunReport report = FullReport(*session_, TargetKind::kRender, monitor_);
  monitor_.Cancel();
  EXPECT_THROW(HtmlReport(*session_, report, {}, monitor_), Cancelled);
}

}  // namespace
}  // namespace retint
