// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/score.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "colmap_io/image_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr int kSize = 20;

// The left `columns` of a square, a fifth of it high.
Mask Left(int columns, uint8_t value = 255) {
  Mask mask(kSize, kSize);
  for (int y = 0; y < kSize / 5; ++y) {
    for (int x = 0; x < columns; ++x) mask(x, y) = value;
  }
  return mask;
}

class ScoreFolders : public testing::Test {
 protected:
  void Truth(const std::string& file, const Mask& mask) {
    WritePng(temp_ / ("truth/" + file), mask);
  }
  void Found(const std::string& file, const Mask& mask) {
    WritePng(temp_ / ("masks/" + file), mask);
  }
  ScoreRequest Request() {
    ScoreRequest request;
    request.truth = temp_ / "truth";
    request.masks = temp_ / "masks";
    return request;
  }
  ScoreReport Run(const ScoreRequest& request) { return Score(request, monitor_); }
  static const ScoreFigure& Figure(const ScoreGroup& group, const std::string& name) {
    for (const ScoreFigure& figure : group.figures) {
      if (figure.name == name) return figure;
    }
    throw std::runtime_error("no figure " + name);
  }

  TempFolder temp_;
  Monitor monitor_;
};

TEST_F(ScoreFolders, SumsUpViewsButForThePainted) {
  // IoU 1, 0.5, 0.8 and, painted, 0.25.
  const int truth[] = {10, 10, 10, 20}, found[] = {10, 5, 8, 5};
  for (int i = 0; i < 4; ++i) {
    const std::string name = "sub/" + std::to_string(i) + ".jpg.png";
    Truth(name, Left(truth[i], i == 1 ? 1 : 255));  // one of zeros and ones
    Found(name, Left(found[i]));
  }
  ScoreRequest request = Request();
  request.painted = {"sub/3.jpg"};
  const ScoreReport report = Run(request);
  ASSERT_EQ(report.views.size(), 4u);
  EXPECT_EQ(report.views[1].view, "sub/1.jpg");
  EXPECT_DOUBLE_EQ(*report.views[3].mask.iou, 0.25);
  EXPECT_TRUE(report.views[3].painted);
  ASSERT_EQ(report.groups.size(), 1u);
  EXPECT_EQ(report.groups[0].views, 3);
  const ScoreFigure& iou = Figure(report.groups[0], "iou");
  EXPECT_DOUBLE_EQ(iou.mean, (1 + 0.5 + 0.8) / 3);
  EXPECT_DOUBLE_EQ(iou.median, 0.8);
  EXPECT_DOUBLE_EQ(iou.worst, 0.5);
  EXPECT_EQ(iou.worst_view, "sub/1.jpg");
  EXPECT_DOUBLE_EQ(Figure(report.groups[0], "precision").mean, 1);

  const auto json = nlohmann::json::parse(ToJson(report));
  EXPECT_DOUBLE_EQ(json["groups"][0]["iou"]["median"], 0.8);
  EXPECT_DOUBLE_EQ(json["views"][1]["recall"], 0.5);
  EXPECT_FALSE(json["views"][1].contains("hit"));
  const std::vector<std::string> lines = ToLines(report);
  for (const std::string& line : lines) EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_THAT(lines, Contains(HasSubstr("all, 3 views")));
  EXPECT_THAT(lines, Contains(HasSubstr("sub/3.jpg (given)")));
  EXPECT_THAT(lines, Contains(HasSubstr("0.7667")));
}

TEST_F(ScoreFolders, GroupsViewsThatLookTheSameWay) {
  Reconstruction model;
  model.cameras[1] = Camera::Pinhole(1, kSize, kSize, 20, 20, 10, 10);
  for (int i = 0; i < 4; ++i) {  // 0, 40, 80 and 120 degrees about the upright axis
    View view;
    view.id = ViewId(i + 1);
    view.name = std::to_string(i) + ".jpg";
    view.camera_id = 1;
    view.cam_from_world.rotation = Eigen::AngleAxisd(i * 40 * M_PI / 180, Eigen::Vector3d::UnitY());
    model.views[view.id] = view;
    Truth(view.name + ".png", Left(10));
    Found(view.name + ".png", Left(10 - i));
  }
  ScoreRequest request = Request();
  request.painted = {"0.jpg"};
  request.model = &model;
  const ScoreReport report = Run(request);
  ASSERT_EQ(report.groups.size(), 2u);
  EXPECT_EQ(report.groups[0].views, 3);
  EXPECT_EQ(report.groups[1].name, "within 50 degrees");
  EXPECT_EQ(report.groups[1].views, 1);
  EXPECT_DOUBLE_EQ(Figure(report.groups[1], "iou").mean, 0.9);
  EXPECT_NEAR(*report.views[2].degrees, 80, 1e-6);
  request.painted = {"0.jpg", "3.jpg"};  // 80 degrees are 40 from the second
  EXPECT_NEAR(*Run(request).views[2].degrees, 40, 1e-6);
  request.painted = {"9.jpg"};
  EXPECT_THROW(Run(request), InputError);
}

TEST_F(ScoreFolders, RefusesAPaintedViewThatNoFolderHas) {
  Truth("0.jpg.png", Left(10));
  for (const char* name : {"0.jpg.png", "1.jpg.png"}) Found(name, Left(10));
  ScoreRequest request = Request();
  request.painted = {"1.jpg"};  // has no true mask
  const std::vector<std::string> warnings = Run(request).warnings;
  EXPECT_THAT(warnings, testing::Contains(HasSubstr("no true mask")));
  request.painted = {"l.jpg"};
  EXPECT_THROW(Run(request), InputError);
}

TEST_F(ScoreFolders, MeasuresEdits) {
  // Everything is to lose its green and blue, and half of the object does.
  Truth("a.jpg.png", Mask(kSize, kSize, 255));
  Image before(kSize, kSize, 1.0f), after = before;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize / 2; ++x) after(x, y, 1) = after(x, y, 2) = 0;
  }
  WritePng(temp_ / "before/a.jpg.png", before);
  WritePng(temp_ / "after/a.jpg.png", after);
  ScoreRequest request;
  request.truth = temp_ / "truth";
  request.before = temp_ / "before";
  request.after = temp_ / "after";
  request.edit = ColorEdit::Tint({1, 0, 0});
  const ScoreReport report = Run(request);
  EXPECT_NEAR(*report.views[0].edit.hit, 0.5, 1e-9);
  EXPECT_DOUBLE_EQ(*report.views[0].edit.missed, 0.5);
  EXPECT_FALSE(report.views[0].edit.leak);  // nothing is outside
  EXPECT_FALSE(report.views[0].mask.iou);
  EXPECT_THAT(ToLines(report), Contains(HasSubstr("hit")));
}

TEST_F(ScoreFolders, RefusesWhatDoesNotFit) {
  Truth("a.jpg.png", Left(10));
  EXPECT_THROW(Run(Request()), InputError);  // no folder of masks
  Found("b.jpg.png", Left(10));
  try {
    Run(Request());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("masks/a.jpg.png: no such mask"));
  }
  Found("a.jpg.png", Mask(3, 3));
  try {
    Run(Request());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("size of its true mask"));
  }
  ScoreRequest request = Request();
  request.truth = temp_ / "masks/none";
  EXPECT_THROW(Run(request), InputError);
  request = Request();
  request.masks.clear();
  EXPECT_THROW(Run(request), OptionError);
  request.after = temp_ / "masks";
  EXPECT_THROW(Run(request), OptionError);  // nothing before
}

}  // namespace
}  // namespace retint
