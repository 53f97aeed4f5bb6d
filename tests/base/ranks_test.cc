// SPDX-License-Identifier: BSD-3-Clause
#include "base/ranks.h"

#include <algorithm>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/thread_ranks.h"

namespace retint {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

TEST(Ranks, AnOrdinaryStartIsOneRank) {
  Ranks& ranks = CurrentRanks();
  EXPECT_TRUE(ranks.IsRoot());
  EXPECT_FALSE(ranks.AreMany());
  EXPECT_THAT(ranks.AllGather("text"), ElementsAre("text"));
  EXPECT_TRUE(ranks.Any(true));
  EXPECT_FALSE(ranks.Any(false));
  float value = 3;
  ranks.SumByRank({&value, 1});
  EXPECT_EQ(value, 3);
  int parts = 0;
  const std::span<std::byte> part = BytesOf(std::span(&value, 1));
  ranks.AddInOrder({&part, 1}, [&](size_t) { ++parts; });
  EXPECT_EQ(parts, 1);
  EXPECT_EQ(ranks.bytes_sent(), 0u);
}

TEST(Ranks, OnlyTheThreadThatSharesIsOne) {
  RunAsRanks(2, [] {
    EXPECT_EQ(CurrentRanks().size(), 2);
    std::thread([] { EXPECT_EQ(CurrentRanks().size(), 1); }).join();
    const ShareAmong alone;
    EXPECT_EQ(CurrentRanks().size(), 1);
  });
  EXPECT_EQ(CurrentRanks().size(), 1);
}

TEST(Ranks, GatherKeepsTheOrderOfTheRanks) {
  const auto all = MakeOnRanks<std::vector<int>>(3, [] {
    // Rank 1 has nothing.
    const int rank = CurrentRanks().rank();
    return CurrentRanks().Gather<int>(std::vector<int>(rank == 1 ? 0 : 2, rank));
  });
  EXPECT_THAT(all, Each(ElementsAre(0, 0, 2, 2)));
}

TEST(Ranks, AnyHearsTheLastRank) {
  const auto all =
      MakeOnRanks<int>(3, [] { return CurrentRanks().Any(CurrentRanks().rank() == 2); });
  EXPECT_THAT(all, Each(1));
}

TEST(Ranks, BroadcastReplacesWhatOthersHave) {
  const auto all = MakeOnRanks<int>(3, [] {
    int value = 10 + CurrentRanks().rank();
    CurrentRanks().Broadcast(BytesOf(std::span(&value, 1)), 1);
    return value;
  });
  EXPECT_THAT(all, Each(11));
}

// Twelve terms whose sum depends on the order in which they are added.
float Term(size_t i) { return (i % 2 ? -1.0f : 1.0f) * 1e7f / float(3 * i + 1) + 0.3f * float(i); }

TEST(Ranks, SumsInOrderAreThoseOfOneRank) {
  constexpr size_t kTerms = 12, kValues = 5;
  const auto sum_of = [] {
    Ranks& ranks = CurrentRanks();
    const std::vector<int> owners = ShareOut(kTerms, ranks);
    std::vector<float> sums(kValues, 0.0f);
    // Two parts of different lengths.
    const std::vector<std::span<std::byte>> parts = {BytesOf(std::span(sums).first(2)),
                                                     BytesOf(std::span(sums).subspan(2))};
    ranks.AddInOrder(parts, [&](size_t part) {
      for (size_t i = 0; i < kTerms; ++i) {
        if (owners[i] != ranks.rank()) continue;
        for (size_t v = part == 0 ? 0 : 2; v < (part == 0 ? 2 : kValues); ++v) {
          sums[v] += Term(i) * float(v + 1);
        }
      }
    });
    return sums;
  };
  const std::vector<float> alone = sum_of();
  for (const int count : {2, 3, 8, 20}) {
    EXPECT_THAT(MakeOnRanks<std::vector<float>>(count, sum_of), Each(alone)) << count;
  }
}

TEST(Ranks, SumByRankAddsInTheirOrder) {
  constexpr size_t kValues = 7;
  const auto value_of = [](int rank, size_t v) { return Term(size_t(rank)) * float(v + 1); };
  for (const int count : {1, 2, 3, 8, 9}) {
    std::vector<float> expected(kValues);
    for (size_t v = 0; v < kValues; ++v) {
      expected[v] = value_of(0, v);
      for (int r = 1; r < count; ++r) expected[v] += value_of(r, v);
    }
    const auto all = MakeOnRanks<std::vector<float>>(count, [&] {
      std::vector<float> values(kValues);
      for (size_t v = 0; v < kValues; ++v) values[v] = value_of(CurrentRanks().rank(), v);
      CurrentRanks().SumByRank(values);
      return values;
    });
    EXPECT_THAT(all, Each(expected)) << count;
  }
}

TEST(Ranks, CountsWhatItSends) {
  const auto sent = MakeOnRanks<uint64_t>(2, [] {
    int value = 1;
    CurrentRanks().Broadcast(BytesOf(std::span(&value, 1)), 0);
    return CurrentRanks().bytes_sent();
  });
  EXPECT_THAT(sent, ElementsAre(4u, 0u));
}

TEST(Ranks, LinkTheirDevices) {
  RunAsRanks(3, [] {
    Ranks& ranks = CurrentRanks();
    EXPECT_EQ(ranks.exchange(), "");
    ranks.LinkDevices("unlinked");
    EXPECT_FALSE(ranks.DevicesAreLinked());
    EXPECT_EQ(ranks.exchange(), "mpi");
    EXPECT_EQ(ranks.link_text(), "there is no link between devices");
    ranks.LinkDevices("device");
    EXPECT_TRUE(ranks.DevicesAreLinked());
    EXPECT_EQ(ranks.exchange(), "nccl");
    EXPECT_EQ(ranks.link_text(), "threads");
    // To the next one, in two pieces, which arrive in their order.
    const int next = (ranks.rank() + 1) % 3, before = (ranks.rank() + 2) % 3;
    int mine[2] = {ranks.rank(), 10 + ranks.rank()}, theirs[2] = {};
    const std::vector<DeviceTransfer> sends = {{next, &mine[0], sizeof(int)},
                                               {next, &mine[1], sizeof(int)}};
    const std::vector<DeviceTransfer> receives = {{before, &theirs[0], sizeof(int)},
                                                  {before, &theirs[1], sizeof(int)}};
    ranks.TransferOnDevices(sends, receives, nullptr);
    EXPECT_THAT(theirs, ElementsAre(before, 10 + before));
    EXPECT_EQ(ranks.bytes_sent(), 2 * sizeof(int));
  });
  CurrentRanks().LinkDevices("device");  // one rank alone
  EXPECT_FALSE(CurrentRanks().UsesLink(1));
  EXPECT_FALSE(CurrentRanks().DevicesAreLinked());
}

// As long as one rank's link is not up, only large arrays wait for it.
TEST(Ranks, SmallArraysDoNotWaitForALink) {
  constexpr size_t kSmall = 1000, kLarge = size_t{1} << 30;
  RunAsRanks(3, [] {
    auto& ranks = dynamic_cast<ThreadRank&>(CurrentRanks());
    EXPECT_FALSE(ranks.UsesLink(kLarge));
    ranks.LinkDevices("device");
    ranks.link_is_up = ranks.rank() != 1;
    EXPECT_FALSE(ranks.UsesLink(kSmall));
    EXPECT_TRUE(ranks.UsesLink(kLarge));
    EXPECT_FALSE(ranks.UsesLink(kSmall));
    ranks.link_is_up = true;
    EXPECT_TRUE(ranks.UsesLink(kSmall));
  });
}

std::vector<int> OwnersAmong(int count, const std::vector<double>& costs) {
  return MakeOnRanks<std::vector<int>>(count, [&] { return ShareOut(costs, CurrentRanks()); })[0];
}

TEST(Ranks, ItemsAreSharedOutByCost) {
  EXPECT_THAT(OwnersAmong(2, {1, 1, 1, 1}), ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(OwnersAmong(3, {1, 1, 1, 1, 1, 1, 1}), ElementsAre(0, 0, 1, 1, 1, 2, 2));
  // One item as costly as the others together.
  EXPECT_THAT(OwnersAmong(2, {1, 1, 1, 3}), ElementsAre(0, 0, 0, 1));
  // More ranks than items; nothing costs anything.
  EXPECT_THAT(OwnersAmong(8, {1, 1}), ElementsAre(2, 6));
  EXPECT_THAT(OwnersAmong(2, {0, 0}), ElementsAre(0, 0));
}

}  // namespace
}  // namespace retint
