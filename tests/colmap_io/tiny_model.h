// SPDX-License-Identifier: BSD-3-Clause
// A made-up model small enough to write out by hand, and comparison of models.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "scene/reconstruction.h"

namespace retint {

// Two cameras, three views (one without observations, one in a subfolder), two points.
inline Reconstruction TinyModel() {
  Reconstruction model;
  model.cameras[1] = Camera::Pinhole(1, 64, 48, 50, 51.5, 32, 24);
  model.cameras[4] = {4, CameraModelId::kSimplePinhole, 30, 20, {25.25, 15, 10}};
  const auto add = [&](ViewId id, const std::string& name, CameraId camera, double x) {
    View view;
    view.id = id;
    view.name = name;
    view.camera_id = camera;
    view.cam_from_world = {Eigen::Quaterniond(0.8, 0, -0.6, 0), {x, 0.1, -2.5}};
    return &(model.views[id] = view);
  };
  View* first = add(2, "a.jpg", 1, 1);
  first->observations = {{{10.5, 20.25}, 7}, {{0.1, 0.2}, kInvalidPointId}, {{63, 47}, 9}};
  add(3, "sub/b c.png", 4, 1e-300)->observations = {{{1, 2}, 9}};
  add(10, "\xC3\xA9t\xC3\xA9.jpg", 1, -3);
  model.points[7] = {7, {0.1, -0.2, 3e10}, {255, 0, 17}, 0.5, {{2, 0}}};
  model.points[9] = {9, {1.0 / 3, 2, 3}, {1, 2, 3}, -1, {{2, 2}, {3, 0}}};
  return model;
}

// Every field bit for bit, but rotations, which may differ by `rotation_tolerance`.
inline void ExpectSame(const Reconstruction& a, const Reconstruction& b,
                       double rotation_tolerance = 0) {
  EXPECT_EQ(a.cameras, b.cameras);
  ASSERT_EQ(a.views.size(), b.views.size());
  for (const auto& [id, view] : a.views) {
    SCOPED_TRACE("view " + std::to_string(id));
    ASSERT_EQ(b.views.count(id), 1u);
    const View& other = b.views.at(id);
    EXPECT_EQ(view.name, other.name);
    EXPECT_EQ(view.camera_id, other.camera_id);
    EXPECT_LE((view.cam_from_world.rotation.coeffs() - other.cam_from_world.rotation.coeffs())
                  .cwiseAbs()
                  .maxCoeff(),
              rotation_tolerance);
    EXPECT_EQ(view.cam_from_world.translation, other.cam_from_world.translation);
    ASSERT_EQ(view.observations.size(), other.observations.size());
    for (size_t i = 0; i < view.observations.size(); ++i) {
      ASSERT_EQ(view.observations[i].xy, other.observations[i].xy) << i;
      ASSERT_EQ(view.observations[i].point_id, other.observations[i].point_id) << i;
    }
  }
  ASSERT_EQ(a.points.size(), b.points.size());
  for (const auto& [id, point] : a.points) {
    ASSERT_EQ(b.points.count(id), 1u) << "point " << id;
    const SparsePoint& other = b.points.at(id);
    ASSERT_EQ(point.xyz, other.xyz) << "point " << id;
    ASSERT_EQ(point.color, other.color) << "point " << id;
    ASSERT_EQ(point.error, other.error) << "point " << id;
    ASSERT_EQ(point.track.size(), other.track.size()) << "point " << id;
    for (size_t i = 0; i < point.track.size(); ++i) {
      ASSERT_EQ(point.track[i].view_id, other.track[i].view_id) << "point " << id;
      ASSERT_EQ(point.track[i].observation_idx, other.track[i].observation_idx) << "point " << id;
    }
  }
}

// One line, and it names the file.
inline void ExpectOneLineNaming(const std::exception& error, const std::string& path) {
  const std::string what = error.what();
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  EXPECT_NE(what.find(path), std::string::npos) << what;
}

}  // namespace retint
