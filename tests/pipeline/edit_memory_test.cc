// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/edit_memory.h"

#include <unistd.h>

#include <gtest/gtest.h>

#include "kernels/backend.h"
#include "pipeline/large_scene.h"
#include "splat_io/splat_io.h"
#include "tests/editing/tiny_session.h"
#include "tests/splat_io/random_scene.h"
#include "tests/support/data.h"

namespace retint {
namespace {

constexpr size_t kMiB = size_t{1} << 20;
constexpr size_t kMillion = 1'000'000;

EditSize SomeEdit(bool on_device) {
  EditSize size;
  size.gaussians = 2 * kMillion;
  size.most_visible = kMillion;
  size.active = kMillion / 10;
  size.views = 16;
  size.largest_pixels = kMillion / 4;
  size.pixels = size.views * size.largest_pixels;
  size.on_device = on_device;
  return size;
}

// The memory of `more` on each side, beyond `size`.
MemoryBytes Added(const EditSize& size, const EditSize& more) {
  return {HostBytesOf(more) - HostBytesOf(size), DeviceBytesOf(more) - DeviceBytesOf(size)};
}

TEST(EditMemory, TakesNothingOfADeviceOnTheCpu) {
  EXPECT_EQ(DeviceBytesOf(SomeEdit(false)), 0U);
  EXPECT_EQ(FitBytesOf(SomeEdit(false)).device, 0U);
}

TEST(EditMemory, AModelIsTwiceOnTheHostOrOnceOnEitherSide) {
  constexpr size_t kModel = 59 * sizeof(float);  // degree 3
  for (const bool on_device : {false, true}) {
    EditSize more = SomeEdit(on_device);
    more.active = 0;  // which brings copies for the report
    const EditSize size = more;
    more.gaussians += kMillion;
    const MemoryBytes added = Added(size, more);
    EXPECT_GE(added.host, (on_device ? 1 : 2) * kModel * kMillion);
    EXPECT_LT(added.host, (on_device ? 2 : 3) * kModel * kMillion);
    EXPECT_GE(added.device, (on_device ? 1 : 0) * kModel * kMillion);
  }
}

// If a splat is in memory as a whole, its output is written from a second model.
TEST(EditMemory, ACopyOfAWholeModelCountsOnTheHostOfADevice) {
  EditSize size = SomeEdit(true);
  EditSize whole = size;
  whole.is_whole = true;
  const MemoryBytes added = Added(size, whole);
  EXPECT_GE(added.host, 59 * sizeof(float) * size.gaussians);
  EXPECT_EQ(added.device, 0U);
}

// 16 coefficients of three floats, of which the solver holds many copies.
TEST(EditMemory, AFitOnADeviceCountsThere) {
  constexpr size_t kCoefficients = 48 * sizeof(float);
  EditSize size = SomeEdit(true);
  size.active = 2 * kMillion;  // more than any other stage
  EditSize more = size;
  more.active += kMillion;
  const MemoryBytes added = Added(size, more);
  EXPECT_GE(added.device, 20 * kCoefficients * kMillion);
  EXPECT_GE(added.host, 3 * kCoefficients * kMillion);  // before, start, after
  EXPECT_LE(added.host, 5 * kCoefficients * kMillion);
  size.on_device = more.on_device = false;
  EXPECT_GE(Added(size, more).host, 20 * kCoefficients * kMillion);
}

TEST(EditMemory, AViewsGeometryAndSurfacesOnADeviceCountThere) {
  EditSize size = SomeEdit(true);
  size.active = 0;
  EditSize more = size;
  more.most_visible += kMillion;
  constexpr size_t kRow = 2 * sizeof(int32_t);  // the host's values for each
  EXPECT_LE(Added(size, more).host, 2 * kRow * kMillion);
  EXPECT_GT(Added(size, more).device, kRow * kMillion);
  size.on_device = more.on_device = false;
  EXPECT_GT(Added(size, more).host, 10 * kRow * kMillion);
}

TEST(EditMemory, TheGraphIsOnTheHostAndSolvedOnTheDevice) {
  EditSize size = SomeEdit(true), more = size;
  more.graph_nodes = 10 * kMillion;  // so many that it is the largest of the stages
  const MemoryBytes added = Added(size, more);
  EXPECT_GE(added.host, 450 * more.graph_nodes);
  EXPECT_GT(added.device, 100 * more.graph_nodes);
  // It is solved before the fit.
  EXPECT_EQ(FitBytesOf(more).device, FitBytesOf(size).device);
}

TEST(EditMemory, StereoAndTheFitOfADeviceDoNotOverlap) {
  EditSize size = SomeEdit(true);
  size.largest_pixels = 8 * kMillion;
  EXPECT_LT(FitBytesOf(size).device + 3000 * kMiB, DeviceBytesOf(size));
  size.active = 4 * kMillion;
  EXPECT_EQ(FitBytesOf(size).device, DeviceBytesOf(size));
}

MemoryLimits LimitsMb(size_t host, size_t device, size_t device_has) {
  return {host * kMiB, device * kMiB, device_has * kMiB};
}

TEST(MemoryLimits, AreMostOfWhatThereIsWhereNoneIsGiven) {
  EXPECT_EQ(LimitsMb(50, 0, 1000).DeviceBytes(), 900 * kMiB);
  EXPECT_EQ(LimitsMb(50, 300, 1000).DeviceBytes(), 300 * kMiB);
  const auto all = size_t(sysconf(_SC_PHYS_PAGES)) * size_t(sysconf(_SC_PAGE_SIZE));
  EXPECT_EQ(LimitsMb(0, 0, 0).HostBytes(), all / 4 * 3);
  EXPECT_TRUE(LimitsMb(50, 0, 1000).Hold({50 * kMiB, 900 * kMiB}));
  EXPECT_FALSE(LimitsMb(50, 0, 1000).Hold({50 * kMiB, 900 * kMiB + 1}));
  EXPECT_FALSE(LimitsMb(50, 0, 1000).Hold({50 * kMiB + 1, 0}));
}

TEST(MemoryLimits, OfADeviceAreNoneOnTheCpu) {
  const auto cpu = CreateBackend("cpu");
  const MemoryLimits limits = LimitsMb(800, 80, 1000).For(*cpu);
  EXPECT_EQ(limits.CacheSide(), MemorySide::kHost);
  EXPECT_EQ(limits.DeviceBytes(), 0U);
  EXPECT_TRUE(limits.Hold({800 * kMiB, DeviceBytesOf(SomeEdit(false))}));
  EXPECT_EQ(limits.Cache(1000 * kMiB), 100 * kMiB);
}

TEST(MemoryLimits, OfADeviceAreWhatItHas) {
  for (const std::string& name : AvailableBackends()) {
    const auto backend = CreateBackend(name);
    const MemoryLimits limits = MemoryLimits{}.For(*backend);
    EXPECT_EQ(limits.CacheSide() == MemorySide::kHost, backend->IsHost()) << name;
    EXPECT_EQ(limits.DeviceBytes() == 0, backend->IsHost()) << name;
  }
}

TEST(MemoryLimits, CachesComeFromWhereTheyLie) {
  const MemoryLimits limits = LimitsMb(80, 800, 1000);
  EXPECT_EQ(limits.Cache(1000 * kMiB), 100 * kMiB);
  EXPECT_EQ(limits.Cache(7 * kMiB), 7 * kMiB);
  EXPECT_EQ(limits.Cache(MemorySide::kHost, 1000 * kMiB), 10 * kMiB);  // photos
  // Of a default, no eighth.
  EXPECT_EQ(LimitsMb(80, 0, 1000).Cache(1000 * kMiB), 1000 * kMiB);
  EXPECT_EQ(LimitsMb(80, 0, 0).Cache(1000 * kMiB), 10 * kMiB);
}

TEST(MemoryLimits, CachesTakeAThirdOfWhatIsLeft) {
  const MemoryLimits limits = LimitsMb(80, 800, 1000);
  const auto beside = [&](MemorySide side, size_t taken) {
    return CacheBeside(limits, side, taken * kMiB, 1000 * kMiB);
  };
  EXPECT_EQ(beside(MemorySide::kDevice, 0), 100 * kMiB);
  EXPECT_EQ(beside(MemorySide::kDevice, 770), 10 * kMiB);
  EXPECT_EQ(beside(MemorySide::kDevice, 900), 0U);
  EXPECT_EQ(beside(MemorySide::kHost, 74), 2 * kMiB);
}

// Memory that a fit keeps of its views has fragments in between, as all memory does.
TEST(EditMemory, WhatAFitKeepsTakesMoreThanItAsksFor) {
  const TinyWorld world = TinyWorld::Make(3, 0, 0, 1);
  const auto session = TinySession(world);
  std::map<std::string, Mask> masks;
  for (int v = 0; v < 3; ++v) masks[world.view(v).name] = world.BallMask(world.Posed(v));
  Monitor monitor;
  const RegionId ball =
      session->store().Add("ball", masks, {}, ColorEdit::Tint({1, 1, 1}), monitor);
  EditSize size = SizeOfWhole(*session);
  size.refit.region_cache_mb = 0x1p22;
  const auto kept_within = [&](size_t bytes) {
    return RegionCacheThatFits({.host_bytes = bytes}, *session, ball, size);
  };
  const double more = double(kept_within(6144 * kMiB) - kept_within(4096 * kMiB));
  // Of fragments some hundredths; other tests' memory may be given back between the two.
  EXPECT_LT(more, 0.96 * 2048 * kMiB);
  EXPECT_GT(more, 0.9 * 2048 * kMiB);
}

TEST(MemoryLimits, ARefusalSaysWhatIsEnough) {
  const MemoryLimits limits = LimitsMb(50, 300, 1000);
  const MemoryBytes host{95 * kMiB + 1, 0}, device{0, 700 * kMiB};
  EXPECT_EQ(TooLittle(limits, host), "`memory_mb=50` is too little");
  EXPECT_EQ(Enough(limits, host, 0), "`memory_mb=96` is enough");
  EXPECT_TRUE(LimitsMb(96, 300, 1000).Hold(host));
  EXPECT_EQ(TooLittle(limits, device), "`device_memory_mb=300` is too little");
  EXPECT_EQ(Enough(limits, device, 0), "`device_memory_mb=700` is enough");
  EXPECT_TRUE(LimitsMb(50, 700, 1000).Hold(device));
  // Of both, lest the second be refused when the first is given.
  const MemoryBytes both{host.host, device.device};
  EXPECT_EQ(TooLittle(limits, both), "`memory_mb=50` and `device_memory_mb=300` are too little");
  EXPECT_EQ(Enough(limits, both, 0), "`memory_mb=96` and `device_memory_mb=700` are enough");
}

TEST(MemoryLimits, ARefusalNeverAsksForMoreThanTheDeviceHas) {
  const MemoryLimits limits = LimitsMb(50, 0, 1000);
  const MemoryBytes most{0, 950 * kMiB}, more{0, 1100 * kMiB};
  EXPECT_EQ(TooLittle(limits, most), "the default `device_memory_mb=900` is too little");
  EXPECT_EQ(Enough(limits, most, 0), "`device_memory_mb=950` is enough");
  EXPECT_TRUE(LimitsMb(50, 950, 1000).Hold(most));
  EXPECT_EQ(Enough(limits, more, 2000 * kMiB),
            "a GPU with 1223 MiB free is enough, or `backend=cpu` `memory_mb=2000`");
  EXPECT_TRUE(LimitsMb(50, 0, 1223).Hold(more));
}

// Without a limit, by the memory of the device; the host has other caches.
TEST(IsTooLarge, CountsCachesWhereTheyLie) {
  const TempFolder folder;
  WriteSplat(folder / "a.ply", RandomScene(100, 3));
  const size_t caches = 2000 * kMiB;
  EXPECT_FALSE(IsTooLarge(folder / "a.ply", LimitsMb(64000, 0, 0), caches));
  EXPECT_TRUE(IsTooLarge(folder / "a.ply", LimitsMb(1900, 0, 0), caches));
  EXPECT_TRUE(IsTooLarge(folder / "a.ply", LimitsMb(64000, 0, 1000), caches));
  EXPECT_TRUE(IsTooLarge(folder / "a.ply", LimitsMb(64000, 1900, 4000), caches));
  EXPECT_FALSE(IsTooLarge(folder / "a.ply", LimitsMb(1900, 0, 4000), caches));
}

}  // namespace
}  // namespace retint
