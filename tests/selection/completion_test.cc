// SPDX-License-Identifier: BSD-3-Clause
#include "selection/completion.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/monitor.h"

namespace retint {
namespace {

constexpr float kY00 = 0.28209479177387814f;
constexpr int kBallPoints = 600;
constexpr double kPi = 3.14159265358979;

// A red ball on a gray floor, and a second red ball far from the first.
struct World {
  GaussianModel model;
  size_t floor_begin = 0, far_begin = 0;  // the ball comes first
  std::vector<float> inside, known, visible;
  mutable std::vector<float> painted, visible_squared;  // missing: not by painted views

  size_t count() const { return model.NumGaussians(); }
  float x(size_t g) const { return model.means[3 * g]; }
  ShareEvidence evidence() const {
    painted.resize(count(), 0);
    visible_squared.resize(count(), 1);
    return {inside, known, known, painted, visible, visible_squared};
  }
};

void AddGaussian(float x, float y, float z, const float (&rgb)[3], GaussianModel* model) {
  for (const float value : {x, y, z}) model->means.push_back(value);
  for (const float value : {1.0f, 0.0f, 0.0f, 0.0f}) model->quats_wxyz.push_back(value);
  for (int axis = 0; axis < 3; ++axis) model->log_scales.push_back(std::log(0.05f));
  model->opacity_logits.push_back(3);
  for (const float channel : rgb) model->sh.push_back((channel - 0.5f) / kY00);
}

void AddBall(float at, GaussianModel* model) {
  for (int i = 0; i < kBallPoints; ++i) {  // a Fibonacci lattice
    const double z = 1 - 2 * (i + 0.5) / kBallPoints, r = std::sqrt(1 - z * z);
    const double angle = i * kPi * (3 - std::sqrt(5.0));
    const float shade = 0.7f + 0.2f * float(z);
    AddGaussian(at + float(r * std::cos(angle)), float(r * std::sin(angle)), float(z),
                {shade, 0.1f, 0.1f}, model);
  }
}

// Everything at x > 0 was seen by the painted view, 40 of its 80 pixels or more; nothing else was.
World MakeWorld() {
  World world;
  AddBall(0, &world.model);
  world.floor_begin = world.count();
  for (int i = -30; i < 30; ++i) {
    for (int j = -15; j < 15; ++j) {
      const float shade = 0.5f + 0.01f * float((i * 7 + j * 3) % 5);
      AddGaussian(0.1f * float(i), 0.1f * float(j), -1.05f, {shade, shade, shade}, &world.model);
    }
  }
  world.far_begin = world.count();
  AddBall(-20, &world.model);
  for (size_t g = 0; g < world.count(); ++g) {
    const bool seen = world.x(g) > 0;
    world.visible.push_back(80);
    world.known.push_back(seen ? 60 : 0);
    world.inside.push_back(seen && g < world.floor_begin ? 60 : 0);
  }
  return world;
}

CompletedShares CompleteAll(const World& world, Completion completion) {
  Monitor monitor;
  return CompleteShares(GaussianGraph(world.model, monitor), world.evidence(), completion, monitor);
}

std::vector<float> Complete(const World& world, Completion completion) {
  return CompleteAll(world, completion).shares;
}

double Mean(const std::vector<float>& shares, size_t begin, size_t end) {
  double sum = 0;
  for (size_t g = begin; g < end; ++g) sum += double(shares[g]);
  return sum / double(end - begin);
}

TEST(Completion, GivesTheBackOfABallToItsFrontAndNoneOfTheFloor) {
  const World world = MakeWorld();
  const auto shares = Complete(world, Completion::kNear);
  double back = 0, floor = 0;
  int backs = 0, floors = 0;
  for (size_t g = 0; g < world.far_begin; ++g) {
    if (world.x(g) > 0) continue;
    (g < world.floor_begin ? back : floor) += double(shares[g]);
    ++(g < world.floor_begin ? backs : floors);
  }
  // The colors are 0.2 apart in OKLab, so that nothing but the smoothing itself costs anything.
  EXPECT_GT(back / backs, 0.9);
  EXPECT_LT(floor / floors, 0.05);
}

// The rim of the ball's front was not painted: more Gaussians than the floor has, but few pixels.
TEST(Completion, LearnsColorsByPixelsAndNotByGaussians) {
  World world = MakeWorld();
  for (size_t g = world.floor_begin; g < world.far_begin; ++g) {
    world.known[g] *= 20;
    world.visible[g] *= 20;
  }
  const size_t rim = world.count();
  for (int i = 0; i < 1500; ++i) {
    const float angle = 2 * float(kPi) * float(i) / 1500;
    const float shade = 0.7f + 0.2f * std::sin(angle);
    AddGaussian(0.02f, std::cos(angle), std::sin(angle), {shade, 0.1f, 0.1f}, &world.model);
    world.inside.push_back(0);
    world.known.push_back(i % 10 == 0 ? 16.0f : 0.8f);
    world.visible.push_back(i % 10 == 0 ? 20.0f : 400.0f);
  }
  const auto shares = Complete(world, Completion::kNear);
  EXPECT_LT(Mean(shares, rim, rim + 1), 0.1);  // the evidence of paint stays
  double back = 0;
  int backs = 0;
  for (size_t g = 0; g < world.floor_begin; ++g) {
    if (world.x(g) < -0.2f) back += double(shares[g]), ++backs;
  }
  EXPECT_GT(back / backs, 0.8);
}

// Haze before the ball's front and on the floor beside it. The painted view sees it as others do,
// but the depth of the surface behind it differs in each of them.
TEST(Completion, KeepsWhatPaintedViewsSeeThoughOthersDoNotFindIt) {
  World world = MakeWorld();
  const size_t haze = world.count();
  for (const bool floor : {false, true}) {
    for (int i = 0; i < 20; ++i) {
      AddGaussian(1 + 0.02f * float(i), 0, floor ? -1 : 0, {0.5f, floor ? 0.1f : 0.5f, 0.1f},
                  &world.model);
      world.visible.push_back(800);
      world.known.push_back(16);
      world.inside.push_back(floor ? 0 : 7);
    }
  }
  const std::vector<float> lost = Complete(world, Completion::kNear);
  world.painted.resize(world.count(), 0);
  world.visible_squared.resize(world.count(), 1);
  for (size_t g = haze; g < world.count(); ++g) {
    world.painted[g] = 16;
    world.visible_squared[g] = 800 * 20;  // 20 pixels in each of 40 views
  }
  const CompletedShares kept = CompleteAll(world, Completion::kNear);
  for (size_t g = haze; g < world.count(); ++g) {
    EXPECT_FLOAT_EQ(kept.shares[g], world.inside[g] / world.known[g]) << g;
    EXPECT_EQ(kept.confidence[g], 1) << g;
  }
  EXPECT_GT(std::abs(Mean(lost, haze, haze + 20) - 7.0 / 16), 0.1);
}

TEST(Completion, KeepsWhatPaintedViewsSeeAQuarterOf) {
  World world = MakeWorld();
  const size_t haze = world.count();
  const float usual = 20;  // pixels in each of 40 views
  for (const float part : {0.24f, 0.26f}) {
    AddGaussian(1 + part, 0, 0, {0.5f, 0.5f, 0.1f}, &world.model);
    world.visible.push_back(40 * usual);
    world.known.push_back(16);
    world.inside.push_back(7);
    world.painted.resize(world.count(), 0);
    world.visible_squared.resize(world.count(), 1);
    world.painted.back() = part * usual;
    world.visible_squared.back() = 40 * usual * usual;
  }
  const CompletedShares completed = CompleteAll(world, Completion::kNear);
  const float by_paint = 7.0f / 16;
  EXPECT_EQ(completed.shares[haze + 1], by_paint);
  EXPECT_EQ(completed.confidence[haze + 1], 1);
  // Paint covers 24/25 of the needed quarter; the graph decides the rest.
  EXPECT_NE(completed.shares[haze], by_paint);
  EXPECT_NEAR(completed.shares[haze], by_paint, 0.04);
  EXPECT_LT(completed.confidence[haze], 1);
}

TEST(Completion, KeepsWhatPaintSeesHalfOf) {
  World world = MakeWorld();
  const size_t first = world.count();
  for (const float part : {0.48f, 0.52f}) {
    AddGaussian(1 + part, 0, 0, {0.5f, 0.5f, 0.1f}, &world.model);
    world.visible.push_back(100);
    world.known.push_back(100 * part);
    world.inside.push_back(50 * part);
  }
  const CompletedShares completed = CompleteAll(world, Completion::kNear);
  EXPECT_LT(completed.confidence[first], 1);
  EXPECT_NE(completed.shares[first], 0.5f);
  EXPECT_EQ(completed.confidence[first + 1], 1);
  EXPECT_EQ(completed.shares[first + 1], 0.5f);
}

TEST(Completion, LeavesSeparateThingsAloneUnlessAskedForAll) {
  const World world = MakeWorld();
  EXPECT_EQ(Mean(Complete(world, Completion::kNear), world.far_begin, world.count()), 0);
  EXPECT_GT(Mean(Complete(world, Completion::kAll), world.far_begin, world.count()), 0.9);
}

// A thread of the ball's color leads to the other one, which is twenty of its radii away.
TEST(Completion, EndsFarFromWhatWasPainted) {
  World world = MakeWorld();
  for (int i = 0; i < 360; ++i) {
    AddGaussian(-1 - 0.05f * float(i), 0, 0, {0.7f, 0.1f, 0.1f}, &world.model);
  }
  for (auto* values : {&world.inside, &world.known}) values->resize(world.count(), 0);
  world.visible.resize(world.count(), 80);
  const size_t thread = world.far_begin + size_t(kBallPoints);
  const auto near = Complete(world, Completion::kNear), all = Complete(world, Completion::kAll);
  EXPECT_EQ(Mean(near, world.far_begin, thread), 0);
  EXPECT_GT(Mean(all, world.far_begin, thread), 0.9);
  EXPECT_GT(near[thread], 0.5f);  // where the thread begins
  EXPECT_EQ(near[world.count() - 1], 0);
}

// The whole ball is painted, so the radius of the painted part is that of the ball, 1. A thread of
// its color is selected up to five times that.
TEST(Completion, ReachesFiveTimesTheRadiusOfWhatWasPainted) {
  World world = MakeWorld();
  for (size_t g = 0; g < world.floor_begin; ++g) world.known[g] = world.inside[g] = 60;
  const size_t thread = world.count();
  for (int i = 0; i < 100; ++i) {
    AddGaussian(-1.05f - 0.05f * float(i), 0, 0, {0.7f, 0.1f, 0.1f}, &world.model);
  }
  for (auto* values : {&world.inside, &world.known}) values->resize(world.count(), 0);
  world.visible.resize(world.count(), 80);
  const auto near = Complete(world, Completion::kNear), all = Complete(world, Completion::kAll);
  for (size_t g = thread; g < world.count(); ++g) {
    // The median of a lattice of 600 points is a hundredth of the radius beside the middle.
    if (world.x(g) > -4.9f) {
      EXPECT_GT(near[g], 0.5f) << world.x(g);
    } else if (world.x(g) < -5.1f) {
      EXPECT_EQ(near[g], 0) << world.x(g);
    }
    EXPECT_GT(all[g], 0.5f) << world.x(g);
  }
}

// A few pixels of another object, inside by mistake, do not connect it to the painted part.
TEST(Completion, WhatPaintHardlyKnowsIsNoPlaceToStartFrom) {
  World world = MakeWorld();
  for (size_t g = world.far_begin; g < world.count(); ++g) world.model.means[3 * g] += 16.5f;
  for (size_t g = world.far_begin; g < world.far_begin + 30; ++g) {
    world.known[g] = world.inside[g] = 4;
  }
  const auto near = Complete(world, Completion::kNear), all = Complete(world, Completion::kAll);
  EXPECT_LT(Mean(near, world.far_begin + 30, world.count()), 0.01);
  EXPECT_GT(Mean(all, world.far_begin + 30, world.count()), 0.9);
}

// A plate of one color from x = -3 to 3; known to be inside below -2 and outside above 2.
World MakePlate() {
  World world;
  for (int i = -30; i < 30; ++i) {
    for (int j = -10; j < 10; ++j) {
      const float shade = 0.5f + 0.01f * float((i * 7 + j * 3) % 5);
      AddGaussian(0.1f * float(i), 0.1f * float(j), 0, {shade, shade, shade}, &world.model);
    }
  }
  for (size_t g = 0; g < world.count(); ++g) {
    const float x = world.x(g);
    world.visible.push_back(80);
    world.known.push_back(std::abs(x) > 2 ? 80 : 0);
    world.inside.push_back(x < -2 ? 80 : 0);
  }
  return world;
}

// The mean between two values of x.
double MeanBetween(const World& world, const std::vector<float>& shares, float low, float high) {
  double sum = 0, count = 0;
  for (size_t g = 0; g < world.count(); ++g) {
    if (world.x(g) < low || world.x(g) > high) continue;
    sum += double(shares[g]), ++count;
  }
  return sum / count;
}

TEST(Completion, EndsThingsOfOneColorAtAValley) {
  const World world = MakePlate();
  Monitor monitor;
  const auto complete = [&](float valley_at) {
    std::vector<float> valleys(world.count(), 0);
    for (size_t g = 0; g < world.count(); ++g) {
      if (std::abs(world.x(g) - valley_at) < 0.15f) valleys[g] = 1;
    }
    const GaussianGraph graph(world.model, monitor, std::nullopt, {valleys, {}});
    return CompleteShares(graph, world.evidence(), Completion::kNear, monitor).shares;
  };
  // The valley is three rows wide on a way of forty: most of the difference falls there, wherever
  // it is.
  for (const float at : {-1.0f, 1.0f}) {
    const auto shares = complete(at);
    EXPECT_GT(MeanBetween(world, shares, -1.95f, at - 0.25f), 0.8) << at;
    EXPECT_LT(MeanBetween(world, shares, at + 0.25f, 1.95f), 0.2) << at;
  }
}

// As many floaters as plate Gaussians, of the same color and known to be outside, in a place
// without any other known Gaussian.
TEST(Completion, LearnsNothingFromWhatFloats) {
  World world = MakePlate();
  const size_t plate = world.count();
  for (size_t g = 0; g < plate; ++g) {
    AddGaussian(world.x(g), 0.05f, 0.1f, {0.52f, 0.52f, 0.52f}, &world.model);
    world.visible.push_back(80);
    world.known.push_back(80);
    world.inside.push_back(0);
  }
  Monitor monitor;
  const auto inside_half = [&](float floats) {
    std::vector<float> floating(world.count(), 0);
    std::fill(floating.begin() + std::ptrdiff_t(plate), floating.end(), floats);
    const GaussianGraph graph(world.model, monitor, std::nullopt, {{}, floating});
    auto shares = CompleteShares(graph, world.evidence(), Completion::kNear, monitor).shares;
    double sum = 0, count = 0;
    for (size_t g = 0; g < plate; ++g) {
      if (world.x(g) < -1.95f || world.x(g) > -0.5f) continue;
      sum += double(shares[g]), ++count;
    }
    return sum / count;
  };
  EXPECT_LT(inside_half(0), 0.3);
  EXPECT_GT(inside_half(1), 0.6);
}

TEST(Completion, KeepsWhatPaintProves) {
  World world = MakeWorld();
  // Completely known, against the evidence of color and neighbors.
  const size_t in = world.floor_begin + 5, out = 5;
  for (const size_t g : {in, out}) world.known[g] = world.visible[g];
  world.inside[in] = world.known[in];
  world.inside[out] = 0;
  const auto shares = Complete(world, Completion::kNear);
  EXPECT_EQ(shares[in], 1);
  EXPECT_EQ(shares[out], 0);
}

TEST(Completion, IsSureOfWhatPaintDecidesAndDoubtsWhatItNeverSaw) {
  const World world = MakeWorld();
  const CompletedShares completed = CompleteAll(world, Completion::kNear);
  for (size_t g = 0; g < world.count(); ++g) {
    const float confidence = completed.confidence[g];
    if (world.known[g] > 0) {
      EXPECT_EQ(confidence, 1) << g;
    } else if (completed.shares[g] > 0) {
      EXPECT_LE(confidence, 0.8f) << g;  // 0.75 of a sure inside; x_g is just below 1
    }
    EXPECT_GE(confidence, 0);
  }
  // The floor has the color of the floor that was painted around.
  double floor = 0;
  int floors = 0;
  for (size_t g = world.floor_begin; g < world.far_begin; ++g) {
    if (world.x(g) < -2) floor += double(completed.confidence[g]), ++floors;
  }
  EXPECT_GT(floor / floors, 0.9);
}

TEST(Completion, NeverTurnsAroundWhatPaintDecides) {
  // Every third Gaussian that was seen contradicts its color and its neighbors.
  World world = MakeWorld();
  for (size_t g = 0; g < world.far_begin; g += 3) {
    if (world.known[g] > 0) world.inside[g] = world.known[g] - world.inside[g];
  }
  for (const Completion completion : {Completion::kNear, Completion::kAll}) {
    const auto shares = Complete(world, completion);
    for (size_t g = 0; g < world.far_begin; ++g) {
      if (world.known[g] > 0) {
        EXPECT_EQ(shares[g], world.inside[g] / world.known[g]) << g;
      }
    }
  }
}

TEST(Completion, OverAPartOfTheSceneLeavesTheRestOutside) {
  const World world = MakeWorld();
  Monitor monitor;
  const Eigen::AlignedBox3f box(Eigen::Vector3f(-4, -4, -4), Eigen::Vector3f(4, 4, 4));
  const GaussianGraph part(world.model, monitor, box);
  EXPECT_EQ(part.NumNodes(), world.far_begin);
  EXPECT_EQ(part.NumGaussians(), world.count());
  // Asked for all that looks the same, it finds nothing beyond its box.
  const auto shares = CompleteShares(part, world.evidence(), Completion::kAll, monitor).shares;
  EXPECT_EQ(Mean(shares, world.far_begin, world.count()), 0);
  EXPECT_GT(Mean(shares, 0, world.floor_begin), 0.9);
}

TEST(Completion, WithoutColorsToLearnFromTheUnknownIsOutside) {
  World world = MakeWorld();
  for (size_t g = world.floor_begin; g < world.count(); ++g) world.known[g] = world.inside[g] = 0;
  const auto shares = Complete(world, Completion::kAll);
  for (size_t g = 0; g < world.count(); ++g) {
    EXPECT_EQ(shares[g], world.inside[g] > 0 ? 1 : 0) << g;
  }
}

TEST(Completion, TakesFewerGaussiansThanNeighbors) {
  World world;
  for (int i = 0; i < 3; ++i) AddGaussian(float(i), 0, 0, {0.5f, 0.5f, 0.5f}, &world.model);
  world.visible = {10, 10, 10};
  world.known = {10, 2.5f, 0};  // half of the visibility, and more, is as good as all of it
  world.inside = {10, 2.5f, 0};
  EXPECT_EQ(Complete(world, Completion::kNear), (std::vector<float>{1, 0.5f, 0}));
}

TEST(Completion, RefusesEvidenceOfAnotherScene) {
  World world = MakeWorld();
  world.known.pop_back();
  EXPECT_THROW(Complete(world, Completion::kNear), OptionError);
}

TEST(Completion, CanBeCancelled) {
  const World world = MakeWorld();
  Monitor monitor;
  const GaussianGraph graph(world.model, monitor);
  monitor.Cancel();
  EXPECT_THROW(CompleteShares(graph, world.evidence(), Completion::kNear, monitor), Cancelled);
}

}  // namespace
}  // namespace retint
