// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/shapes.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

struct Named {
  std::string name;
  ShapePtr shape;
  bool closed;
};

std::vector<Named> AllShapes() {
  std::vector<Named> shapes;
  shapes.push_back(
      {"quad", Quad(Vec3(-0.4, 0.1, -0.4), Vec3(0.9, 0.1, 0), Vec3(-0.03, 0.27, 0.8)), false});
  shapes.push_back({"sphere", Sphere(Vec3(0.1, -0.2, 0.05), 0.4), true});
  shapes.push_back(
      {"rounded box", RoundedBox(Vec3(0, 0.1, 0), Vec3(0.4, 0.25, 0.3), 0.06, 0.7), true});
  // A cone with flat ends: every crease is sharp, so that normals are the surface's own.
  shapes.push_back(
      {"lathe", Lathe(Vec3(0.05, 0.3, 0), {{0, 0}, {0.4, 0}, {0.2, 0.6}, {0, 0.6}}), true});
  shapes.push_back({"capsule", Capsule(Vec3(-0.2, 0.3, 0.1), Vec3(0.3, -0.2, 0), 0.15), true});
  shapes.push_back(
      {"leaf",
       Leaf(Vec3(-0.4, 0, 0), Vec3(1, -0.2, 0.3), Vec3(0.1, -1, 0), {0.9, 0.5, 0.8, 0.1, 0.8}),
       false});
  return shapes;
}

// A ray from a sphere around the shape to somewhere near its middle.
Ray RandomRay(Random* random) {
  const auto direction = [&] {
    return Vec3(random->Gaussian(), random->Gaussian(), random->Gaussian()).normalized();
  };
  const Vec3 origin = 2 * direction();
  return {origin, 1.7 * (0.45 * random->Uniform() * direction() - origin)};
}

TEST(SyntheticShapesTest, HitsLieOnTheirChartsWithTheRightNormal) {
  for (const Named& named : AllShapes()) {
    SCOPED_TRACE(named.name);
    Random random(7);
    int hits = 0;
    for (int i = 0; i < 3000; ++i) {
      const Ray ray = RandomRay(&random);
      Hit hit;
      if (!named.shape->Intersect(ray, 0, 10, &hit)) continue;
      ++hits;
      const Vec3 point = ray.At(hit.t);
      ASSERT_NEAR(hit.normal.norm(), 1, 1e-9);
      ASSERT_LE(hit.normal.dot(ray.direction), 1e-9) << "normal away from the ray";
      ASSERT_TRUE(named.shape->bounds.contains(point) ||
                  named.shape->bounds.exteriorDistance(point) < 1e-9);
      ASSERT_LT(size_t(hit.chart), named.shape->chart_sizes.size());
      // At a rounded corner of three charts, and on the caps of a capsule, charts are only
      // approximate.
      const Surfel at = named.shape->At(hit.chart, hit.uv);
      if ((at.point - point).norm() > 1e-6) {
        ASSERT_TRUE(named.name == "rounded box" || named.name == "capsule");
        continue;
      }
      ASSERT_GT(std::abs(at.normal.dot(hit.normal)), 1 - 1e-6);
      // Along the surface the normal is perpendicular, to first order in the step.
      const double step = 1e-5;
      for (const Vec2& d : {Vec2(step, 0), Vec2(0, step)}) {
        const Vec3 along = named.shape->At(hit.chart, hit.uv + d).point -
                           named.shape->At(hit.chart, hit.uv - d).point;
        if (along.norm() < 1e-7 || along.norm() > 1e-2) continue;                     // pole, seam
        if (named.name == "leaf" && std::abs(hit.uv.y() - 0.5) < 2 * step) continue;  // crease
        ASSERT_LT(std::abs(along.normalized().dot(hit.normal)), 2e-3);
      }
    }
    EXPECT_GT(hits, 300);
  }
}

TEST(SyntheticShapesTest, ClosedShapesBeginAtTheFirstHit) {
  for (const Named& named : AllShapes()) {
    if (!named.closed) continue;
    SCOPED_TRACE(named.name);
    Random random(8);
    for (int i = 0; i < 500; ++i) {
      const Ray ray = RandomRay(&random);
      Hit hit;
      const bool met = named.shape->Intersect(ray, 0, 10, &hit);
      const double end = met ? hit.t - 1e-5 : 1.5;
      for (int k = 0; k < 200; ++k) {
        const double t = end * (k + 0.5) / 200;
        ASSERT_FALSE(named.shape->Contains(ray.At(t)))
            << "inside before the hit, t = " << t << " of " << end;
      }
      // Just below the surface, along the normal.
      if (met) {
        const Vec3 below = ray.At(hit.t) - 1e-4 * hit.normal;
        ASSERT_TRUE(named.shape->Contains(below));
      }
    }
  }
}

TEST(SyntheticShapesTest, IntervalIsRespected) {
  for (const Named& named : AllShapes()) {
    SCOPED_TRACE(named.name);
    Random random(9);
    for (int i = 0; i < 300; ++i) {
      const Ray ray = RandomRay(&random);
      Hit hit, none;
      if (!named.shape->Intersect(ray, 0, 10, &hit)) continue;
      ASSERT_FALSE(named.shape->Intersect(ray, 0, hit.t * (1 - 1e-9), &none));
    }
  }
}

}  // namespace
}  // namespace retint::synthetic
