// SPDX-License-Identifier: BSD-3-Clause
// Sums and copies on devices that are linked. The host stands for the devices here; on GPUs
// tests/e2e/cluster_test.cc compares the bytes of whole runs.
#include "render/device_exchange.h"

#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/thread_ranks.h"

namespace retint {
namespace {

using ::testing::Each;

// Terms whose sum depends on the order in which they are added.
float Term(int rank, size_t i) {
  return (rank % 2 ? -1.0f : 1.0f) * std::ldexp(1.0f, 5 * rank) / float(i + 3) + 0.3f * float(i);
}

Buffer<float> TermsOf(Backend& backend, size_t count) {
  std::vector<float> terms(count);
  for (size_t i = 0; i < count; ++i) terms[i] = Term(CurrentRanks().rank(), i);
  return backend.Upload(std::span<const float>(terms));
}

class DeviceExchange : public testing::TestWithParam<size_t> {};

// Of stretches longer and shorter than the array, and of fewer values than ranks.
TEST_P(DeviceExchange, SumsAreThoseOfTheHosts) {
  const std::shared_ptr<Backend> backend = CreateBackend("cpu");
  constexpr size_t kValues = 103;
  for (const int count : {2, 3, 8, 9}) {
    SCOPED_TRACE(count);
    const auto by_hosts = MakeOnRanks<std::vector<float>>(count, [&] {
      const Buffer<float> values = TermsOf(*backend, kValues);
      CurrentRanks().SumByRank({values.data(), kValues});
      return backend->Download(values.data(), kValues);
    });
    const auto by_devices = MakeOnRanks<std::vector<float>>(count, [&] {
      Buffer<float> values = TermsOf(*backend, kValues), scratch;
      CurrentRanks().LinkDevices("device");
      SumOnDevices(CurrentRanks(), *backend, values, scratch, GetParam());
      EXPECT_LE(scratch.size(), GetParam() + size_t(count));
      return backend->Download(values.data(), kValues);
    });
    EXPECT_THAT(by_devices, Each(by_hosts[0]));
  }
}

INSTANTIATE_TEST_SUITE_P(Stretches, DeviceExchange, testing::Values(5, 16, 103, 1000));

TEST(DeviceExchange, AnEmptyArrayIsNoWork) {
  const std::shared_ptr<Backend> backend = CreateBackend("cpu");
  RunAsRanks(2, [&] {
    Buffer<float> values, scratch;
    CurrentRanks().LinkDevices("device");
    SumOnDevices(CurrentRanks(), *backend, values, scratch);
    BroadcastOnDevices(CurrentRanks(), *backend, values, 1);
    EXPECT_EQ(CurrentRanks().bytes_sent(), 0u);
  });
}

TEST(DeviceExchange, OneRanksValuesReplaceThoseOfTheOthers) {
  const std::shared_ptr<Backend> backend = CreateBackend("cpu");
  const auto all = MakeOnRanks<std::vector<float>>(3, [&] {
    Buffer<float> values = TermsOf(*backend, 4);
    CurrentRanks().LinkDevices("device");
    BroadcastOnDevices(CurrentRanks(), *backend, values, 1);
    return backend->Download(values.data(), 4);
  });
  EXPECT_THAT(all, Each(std::vector<float>{Term(1, 0), Term(1, 1), Term(1, 2), Term(1, 3)}));
}

}  // namespace
}  // namespace retint
