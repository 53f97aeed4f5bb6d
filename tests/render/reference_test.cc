// SPDX-License-Identifier: BSD-3-Clause
// Renders of a real capture against those of the original 3DGS rasterizer.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "colmap_io/image_io.h"
#include "colmap_io/workspace.h"
#include "render/renderer.h"
#include "splat_io/splat_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

TEST(Reference, FoxAgreesWithTheOriginalRasterizer) {
  RETINT_REQUIRE_DATA("fox/reference");
  const Workspace workspace = Workspace::Open(DataPath("fox"));
  Renderer renderer(CreateBackend("cpu"), ReadSplat(DataPath("fox/splat.ply")));
  int views = 0;
  for (const std::string name : {"0001", "0025", "0072", "0097"}) {
    const Image8 reference = ReadImage8(DataPath("fox/reference/" + name + ".png"));
    const View& view = workspace.RequireView(name + ".jpg");
    const Image image = renderer.Render(workspace.reconstruction.Posed(view)).rgb;
    ASSERT_EQ(image.width, reference.width);
    ASSERT_EQ(image.height, reference.height);
    double squares = 0;
    for (size_t i = 0; i < image.data.size(); ++i) {
      const double ours = std::round(std::clamp(image.data[i], 0.0f, 1.0f) * 255);
      squares += (ours - reference.data[i]) * (ours - reference.data[i]);
    }
    const double psnr = 10 * std::log10(255.0 * 255.0 * double(image.data.size()) / squares);
    // Only rounding is left: colors half-way between two levels, pairs at the 1/255 threshold.
    EXPECT_GE(psnr, 50) << name;
    RecordProperty("psnr_" + name, std::to_string(psnr));
    ++views;
  }
  EXPECT_EQ(views, 4);
}

}  // namespace
}  // namespace retint
