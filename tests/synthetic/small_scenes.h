// SPDX-License-Identifier: BSD-3-Clause
// Small synthetic scenes that tests look at.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "synthetic/synthetic_scene.h"

namespace retint {

inline SyntheticOptions SmallOptions() {
  SyntheticOptions options;
  options.width = 160;
  options.height = 120;
  options.views = 8;
  return options;
}

inline SyntheticOptions TinyOptions() {
  SyntheticOptions options;
  options.width = 64;
  options.height = 48;
  options.views = 3;
  return options;
}

inline SyntheticScene Make(const SyntheticOptions& options) {
  Monitor monitor;
  return MakeSyntheticScene(options, monitor);
}

inline const SyntheticScene& Small() {
  static const SyntheticScene scene = Make(SmallOptions());
  return scene;
}

inline int IdOf(const SyntheticScene& scene, const std::string& name) {
  const auto it = std::find(scene.object_names.begin(), scene.object_names.end(), name);
  EXPECT_NE(it, scene.object_names.end()) << name;
  return int(it - scene.object_names.begin());
}

inline PosedCamera CameraOf(const SyntheticScene& scene, size_t view) {
  return scene.reconstruction.Posed(*scene.reconstruction.FindView(scene.views[view].name));
}

template <typename Values>
void ExpectSameBytes(const Values& a, const Values& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])), 0);
}

}  // namespace retint
