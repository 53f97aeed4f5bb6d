// SPDX-License-Identifier: BSD-3-Clause
#include "selection/view_depth.h"

#include <cmath>

#include <gtest/gtest.h>

#include "selection/depth_sampling.h"
#include "tests/selection/tiny_gaussians.h"

namespace retint {
namespace {

class ViewDepthTest : public ::testing::Test {
 protected:
  TinyWorld world = TinyWorld::Make(5, 2000, 0, 3);
  TinyGaussians gaussians{world};
  Renderer renderer{CreateBackend("cpu"), gaussians.model};
  std::vector<const View*> views = world.reconstruction.ViewsByName();
};

TEST_F(ViewDepthTest, DepthBiasIsFoundFromTheSparsePoints) {
  const PosedCamera posed = world.Posed(1);
  const DepthMap exact = world.Depth(posed);
  // a = 0.97, b = 0.003 gives z back; a fifth of the image is wrong by 10 %.
  DepthMap biased = exact;
  for (size_t i = 0; i < biased.data.size(); ++i) {
    biased.data[i] = float(0.97 / (1 / exact.data[i] - 0.003));
    if (i % 160 < 32) biased.data[i] *= 1.1f;
  }
  std::vector<double> rendered, sparse;
  for (const auto& observation : world.view(1).observations) {
    const auto at = posed.Project(world.reconstruction.points.at(observation.point_id).xyz);
    rendered.push_back(SampleDepth(biased, at->head<2>()).value_or(0));
    sparse.push_back(at->z());
  }
  const DepthBias bias = FitDepthBias(rendered, sparse);
  EXPECT_GT(bias.points, 500);
  for (size_t i = 0; i < biased.data.size(); ++i) {
    // A Cauchy loss bounds the outliers' pull; the rest is below a fifth of a percent.
    if (i % 160 < 32) continue;
    EXPECT_NEAR(biased.data[i] / (bias.a + bias.b * biased.data[i]) / exact.data[i], 1, 2e-3);
  }
  // Too few points: untouched.
  EXPECT_EQ(FitDepthBias({}, {}).a, 1);
}

TEST_F(ViewDepthTest, SurfacesOfManyViewsAreThoseOfEach) {
  std::vector<SurfaceRequest> requests;
  for (const View* view : views) requests.push_back({world.reconstruction.Posed(*view), view});
  requests[3].view = nullptr;       // a free camera
  requests[1].pixel_rows = 0x5555;  // every second row
  const size_t distinct = requests.size();
  while (requests.size() < 33) requests.push_back(requests[requests.size() - distinct]);
  std::vector<DepthMap> each;
  for (size_t i = 0; i < distinct; ++i) {
    const auto& request = requests[i];
    each.push_back(SurfaceDepth(renderer, request.posed, request.view, world.reconstruction));
    if (request.pixel_rows != kAllPixelRows) continue;
    // The sparse points pull the Gaussians' depth towards the truth.
    const DepthMap truth = world.Depth(request.posed);
    const DepthMap raw = SurfaceDepth(renderer, request.posed, nullptr, world.reconstruction);
    double error = 0, raw_error = 0;
    for (size_t p = 0; p < truth.data.size(); ++p) {
      if (raw.data[p] == 0) continue;
      error += std::abs(each[i].data[p] / truth.data[p] - 1);
      raw_error += std::abs(raw.data[p] / truth.data[p] - 1);
    }
    EXPECT_LE(error, raw_error);
  }
  for (const size_t held_bytes : {SurfaceOptions().held_bytes, size_t{1}}) {
    size_t begun = 0, visited = 0;
    SurfaceOptions surfaces;
    surfaces.held_bytes = held_bytes;
    surfaces.before_each = [&](size_t i) {
      EXPECT_EQ(i, begun);
      if (held_bytes == 1) {
        EXPECT_EQ(begun, visited);  // without room for more, one after another
      }
      ++begun;
    };
    RenderSurfaces(renderer, world.reconstruction, requests, surfaces,
                   [&](size_t i, const ViewSurface& surface) {
                     EXPECT_EQ(i, visited++);
                     const auto depth =
                         renderer.backend().Download(surface.depth.data(), surface.depth.size());
                     if (requests[i].pixel_rows == kAllPixelRows) {
                       EXPECT_EQ(depth, each[i % distinct].data);
                       return;
                     }
                     // Corrected by the sparse points of these rows.
                     const std::vector<float>& all = each[i % distinct].data;
                     const auto width = size_t(requests[i].posed.camera.width);
                     for (size_t p = 0; p < depth.size(); ++p) {
                       if (p / width % 2 != 0) continue;
                       ASSERT_NEAR(depth[p], all[p], 0.01f * all[p]);
                     }
                   });
    EXPECT_EQ(begun, requests.size());
    EXPECT_EQ(visited, requests.size());
  }
  RenderSurfaces(renderer, world.reconstruction, {}, {},
                 [](size_t, const ViewSurface&) { FAIL() << "there is none"; });
}

}  // namespace
}  // namespace retint
