// SPDX-License-Identifier: BSD-3-Clause
#include "render/geometry_cache.h"

#include <memory>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "render/renderer.h"

namespace retint {
namespace {

GaussianModel Cloud(int count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(-1, 1);
  GaussianModel model;
  model.Resize(size_t(count), 0);
  for (size_t g = 0; g < size_t(count); ++g) {
    for (size_t k = 0; k < 3; ++k) model.means[3 * g + k] = unit(random) + (k == 2 ? 3.0f : 0.0f);
    for (size_t k = 0; k < 4; ++k) model.quats_wxyz[4 * g + k] = unit(random);
    for (size_t k = 0; k < 3; ++k) model.log_scales[3 * g + k] = -2.5f + 0.5f * unit(random);
    model.opacity_logits[g] = 3 * unit(random);
    for (size_t k = 0; k < 3; ++k) model.sh[3 * g + k] = 1.5f * unit(random);
  }
  return model;
}

PosedCamera At(int place) {
  return {Camera::Pinhole(7, 96, 64, 80, 80, 48 - place, 32), Rigid3d{}};
}

TEST(GeometryCache, IsSharedByRenderers) {
  const GaussianModel model = Cloud(200);
  const auto cache = std::make_shared<GeometryCache>(size_t{1} << 30);
  Renderer first(CreateBackend("cpu"), model, {}, cache);
  Renderer second(CreateBackend("cpu"), model, {}, cache);
  const auto geometry = first.Geometry(At(0));
  EXPECT_EQ(second.Geometry(At(0)), geometry);
  EXPECT_EQ(second.cached_bytes(), geometry->bytes());
  // Colors are each renderer's own.
  const Image before = second.Render(At(0)).rgb;
  first.SetSh(std::vector<float>(model.sh.size(), 0.5f));
  EXPECT_EQ(second.Render(At(0)).rgb.data, before.data);
  EXPECT_NE(first.Render(At(0)).rgb.data, before.data);
}

TEST(GeometryCache, MakesRoomForWhatIsReserved) {
  const GaussianModel model = Cloud(200);
  const size_t one = Renderer(CreateBackend("cpu"), model).Geometry(At(0))->bytes();
  const auto cache = std::make_shared<GeometryCache>(6 * one);
  EXPECT_EQ(Renderer(CreateBackend("cpu"), model, {}, cache).Reserve(), nullptr);
  Renderer renderer(CreateBackend("cpu"), model, {.makes_room = true}, cache);
  for (int place = 0; place < 4; ++place) renderer.Geometry(At(place));
  const size_t before = cache->bytes();
  EXPECT_GT(before, 3 * one);
  {
    const auto some = renderer.Reserve();
    some->Set(3 * one);
    EXPECT_LE(cache->bytes(), 3 * one);
    EXPECT_TRUE(renderer.HasGeometry(At(3)));
    // More than there is leaves an eighth.
    const auto all = renderer.Reserve();
    all->Set(100 * one);
    EXPECT_LE(cache->bytes(), 6 * one / 8 + 8);
    renderer.Geometry(At(5));
    EXPECT_LE(cache->bytes(), 6 * one / 8 + 8);
    all->Set(0);
    renderer.Geometry(At(5));
    EXPECT_TRUE(renderer.HasGeometry(At(5)));
  }
  for (int place = 0; place < 4; ++place) renderer.Geometry(At(place));
  EXPECT_GE(cache->bytes(), before);
  EXPECT_TRUE(cache->Clear());
  EXPECT_FALSE(cache->Clear());
  EXPECT_EQ(cache->bytes(), 0u);
}

// Threads that draw, push each other's geometries out and reserve: every picture is the one
// that a renderer alone makes.
TEST(GeometryCache, ServesThreadsAtOnce) {
  constexpr int kViews = 6, kThreads = 4, kRounds = 30;
  const GaussianModel model = Cloud(150);
  std::vector<Image> alone;
  size_t one = 0;
  {
    Renderer renderer(CreateBackend("cpu"), model);
    for (int place = 0; place < kViews; ++place) {
      alone.push_back(renderer.Render(At(place)).rgb);
      one = renderer.Geometry(At(place))->bytes();
    }
  }
  const auto cache = std::make_shared<GeometryCache>(3 * one);
  std::vector<int> wrong(kThreads, 0);
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      Renderer renderer(CreateBackend("cpu"), model, {.makes_room = true}, cache);
      for (int round = 0; round < kRounds; ++round) {
        const int place = (round * (t + 1) + t) % kViews;
        const auto reserved = renderer.Reserve();
        if (round % 5 == 0) reserved->Set(one);
        const Image image = renderer.Render(At(place)).rgb;
        wrong[size_t(t)] += image.data != alone[size_t(place)].data;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (int t = 0; t < kThreads; ++t) EXPECT_EQ(wrong[size_t(t)], 0) << "thread " << t;
  EXPECT_LE(cache->bytes(), 3 * one);
}

}  // namespace
}  // namespace retint
