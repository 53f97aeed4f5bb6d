// SPDX-License-Identifier: BSD-3-Clause
// Several processes together find the same as one that works on all views in order.
#include "render/view_reducer.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/thread_ranks.h"

namespace retint {
namespace {

constexpr size_t kViews = 7, kGaussians = 50, kChannels = 2;

// The views of all processes: each view once, ascending, by costs.
TEST(ViewReducerTest, SharesEveryViewOnce) {
  const auto own = [] {
    const auto backend = CreateBackend("cpu");
    const ViewReducer reducer(*backend, kViews,
                              [] { return std::vector<double>{1, 1, 1, 1, 1, 1, 100}; });
    for (size_t view = 0; view < kViews; ++view) {
      const auto& mine = reducer.own();
      EXPECT_EQ(reducer.Owns(view), std::count(mine.begin(), mine.end(), view) == 1);
    }
    return std::vector<size_t>(reducer.own().begin(), reducer.own().end());
  };
  std::vector<size_t> all(kViews);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(own(), all);
  const auto shared = MakeOnRanks<std::vector<size_t>>(2, own);
  EXPECT_EQ(shared[0], std::vector<size_t>({0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(shared[1], std::vector<size_t>({6}));
}

TEST(ViewReducerTest, GathersInTheOrderOfTheViews) {
  struct Found {
    std::vector<int> views, firsts;
    std::vector<uint8_t> flags;
    std::string text;
    std::vector<float> values;
    bool any = false;
  };
  const auto find = [] {
    const auto backend = CreateBackend("cpu");
    ViewReducer reducer(*backend, kViews);
    Found found;
    std::vector<int> own;
    found.flags.assign(kGaussians, 0);
    for (const size_t view : reducer.own()) {
      own.push_back(int(view));
      found.flags[5 * view] = 1;
    }
    found.views = reducer.Gather<int>(own);
    reducer.Unite(&found.flags);
    found.text = reducer.BroadcastText(5, reducer.Owns(5) ? "five" : "not mine");
    Buffer<float> values = backend->Allocate<float>(3);
    if (reducer.Owns(2)) std::fill_n(values.data(), 3, 2.5f);
    reducer.Broadcast(2, values);
    found.values.assign(values.data(), values.data() + 3);
    found.any = reducer.Any(reducer.Owns(6)) && !reducer.Any(false);
    const std::vector<int> first{reducer.IsFirst() ? 1 : 0};
    found.firsts = reducer.Gather<int>(first);
    return found;
  };
  const Found alone = find();
  EXPECT_EQ(alone.views.size(), kViews);
  EXPECT_EQ(alone.text, "five");
  EXPECT_THAT(alone.values, testing::Each(2.5f));
  EXPECT_TRUE(alone.any);
  for (const int count : {2, 3}) {
    for (const Found& one : MakeOnRanks<Found>(count, find)) {
      EXPECT_EQ(one.views, alone.views);
      EXPECT_EQ(one.flags, alone.flags);
      EXPECT_EQ(one.text, alone.text);
      EXPECT_EQ(one.values, alone.values);
      EXPECT_TRUE(one.any);
      EXPECT_EQ(std::accumulate(one.firsts.begin(), one.firsts.end(), 0), 1);
    }
  }
}

// Terms whose sum depends on their order.
template <typename T>
std::vector<T> SumOfRows() {
  const auto backend = CreateBackend("cpu");
  ViewReducer reducer(*backend, kViews);
  std::vector<T> sums((kChannels + 1) * kGaussians, T(reducer.IsFirst() ? 0.1f : 0.0f));
  std::vector<ViewRows> kept;
  for (const size_t view : reducer.own()) {
    ViewRows rows;
    for (size_t g = view; g < kGaussians; g += 1 + view % 3) {
      rows.gaussians.push_back(int32_t(g));
      for (size_t c = 0; c < kChannels; ++c) {
        rows.values.push_back(1e3f / float(3 + g + 7 * view) - float(c + view));
      }
    }
    if (reducer.AddsInOrder()) {
      kept.push_back(std::move(rows));
      continue;
    }
    for (size_t r = 0; r < rows.gaussians.size(); ++r) {
      T* const sum = &sums[(kChannels + 1) * size_t(rows.gaussians[r])];
      const float* const row = &rows.values[kChannels * r];
      for (size_t c = 0; c < kChannels; ++c) sum[c] += T(row[c]);
      sum[kChannels] += T(row[kChannels - 1] * row[kChannels - 1]);
    }
  }
  reducer.SumRows(kept, kChannels, /*and_square=*/true, &sums);
  return sums;
}

TEST(ViewReducerTest, SumsRowsToTheSameBits) {
  for (const int count : {2, 3}) {
    for (const auto& sums : MakeOnRanks<std::vector<float>>(count, SumOfRows<float>)) {
      EXPECT_EQ(sums, SumOfRows<float>());
    }
    for (const auto& sums : MakeOnRanks<std::vector<double>>(count, SumOfRows<double>)) {
      EXPECT_EQ(sums, SumOfRows<double>());
    }
  }
}

}  // namespace
}  // namespace retint
