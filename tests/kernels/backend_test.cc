// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <stdexcept>

#include <gmock/gmock.h>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

TEST(Registry, ListsTheCpuFirst) {
  const auto names = AvailableBackends();
  ASSERT_FALSE(names.empty());
  EXPECT_EQ(names[0], "cpu");
  for (const std::string& name : names) EXPECT_EQ(CreateBackend(name)->Name(), name);
}

TEST(Registry, RefusesUnknownNames) {
  EXPECT_THROW(CreateBackend("gpu"), std::invalid_argument);
  EXPECT_THROW(CreateBackend(""), std::invalid_argument);
  EXPECT_NO_THROW(CreateBackend("auto"));
}

TEST(Registry, SaysWhyThereIsNoCuda) {
  const std::string fault = CudaFault();
  if (fault.empty()) {
    EXPECT_EQ(CreateBackend("auto")->Name(), "cuda");
    EXPECT_EQ(CreateBackend("cuda")->Name(), "cuda");
    return;
  }
  EXPECT_EQ(CreateBackend("auto")->Name(), "cpu");
  try {
    CreateBackend("cuda");
    FAIL() << "there is no device";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(fault));
  }
}

TEST(Registry, DescribesTargetAndThreads) {
  EXPECT_THAT(CreateBackend("cpu")->Description(), testing::HasSubstr("Highway"));
  EXPECT_THAT(MakeBackend("cpu-scalar")->Description(), testing::HasSubstr("scalar"));
}

class Memory : public BackendTest {};

TEST_P(Memory, IsZeroedAndCopied) {
  const auto buffer = backend_->Allocate<float>(1000);
  EXPECT_EQ(backend_->Download(buffer.data(), 1000), std::vector<float>(1000, 0.0f));
  const auto values = UniformVector(rng_, 77, -1, 1);
  const auto copy = backend_->Upload(std::span<const float>(values));
  EXPECT_EQ(backend_->Download(copy.data(), 77), values);
  backend_->Fill(copy.data(), 0, 4 * sizeof(float));
  EXPECT_EQ(backend_->Download(copy.data(), 5), (std::vector<float>{0, 0, 0, 0, values[4]}));
}

// The host's allocator may be one that aborts (sanitizers), so only a device is asked for too much.
TEST_P(Memory, SaysWhatDoesNotFit) {
  if (GetParam() != "cuda") GTEST_SKIP() << "a device's memory";
  try {
    backend_->AllocateBytes(size_t{1} << 50);
    FAIL() << "a petabyte fits";
  } catch (const std::bad_alloc& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("1073741824 MiB"));
  }
  const auto values = UniformVector(rng_, 100, -1, 1);
  const auto copy = backend_->Upload(std::span<const float>(values));
  EXPECT_EQ(backend_->Download(copy.data(), 100), values);
}

TEST_P(Memory, SaysWhatADeviceHasForTheProcess) {
  if (backend_->IsHost()) {
    EXPECT_EQ(backend_->AvailableDeviceBytes(), 0u);
    return;
  }
  constexpr size_t kBytes = size_t{64} << 20;
  const auto buffer = backend_->Allocate<uint8_t>(kBytes);
  EXPECT_GE(backend_->AvailableDeviceBytes(), kBytes);  // its own memory is part of it
}

TEST_P(Memory, SaysWhetherItIsTheHosts) {
  EXPECT_EQ(backend_->IsHost(), GetParam() != "cuda");
  if (!backend_->IsHost()) return;
  const auto buffer = backend_->Allocate<float>(2);
  buffer.data()[1] = 3;  // in place
  EXPECT_EQ(backend_->Download(buffer.data(), 2), (std::vector<float>{0, 3}));
}

// Two backends of one device name it alike. Pages are locked and released; copies stay the same.
TEST_P(Memory, NamesItsDeviceAndLocksPages) {
  EXPECT_EQ(backend_->Identity().empty(), backend_->IsHost());
  EXPECT_EQ(backend_->Stream() == nullptr, backend_->IsHost());
  EXPECT_EQ(MakeBackend(GetParam())->Identity(), backend_->Identity());
  std::vector<float> values = UniformVector(rng_, 100000, -1, 1);
  EXPECT_EQ(backend_->LockPages(values.data(), 0), nullptr);
  for (int i = 0; i < 2; ++i) {
    const auto locked = backend_->LockPages(values.data(), values.size() * sizeof(float));
    EXPECT_TRUE(!locked || !backend_->IsHost());
    const auto copy = backend_->Upload(std::span<const float>(values));
    EXPECT_EQ(backend_->Download(copy.data(), values.size()), values);
  }
}

TEST_P(Memory, GrowsToTheLargest) {
  Buffer<float> buffer;
  const float* const first = backend_->Grow(buffer, 10);
  EXPECT_EQ(buffer.size(), 10u);
  EXPECT_EQ(backend_->Grow(buffer, 4), first);
  EXPECT_EQ(buffer.size(), 10u);
  backend_->Fill(buffer.data(), 0x7f, 10 * sizeof(float));
  backend_->Grow(buffer, 1000);
  EXPECT_EQ(backend_->Download(buffer.data(), 1000), std::vector<float>(1000, 0.0f));
}

// Copies of one piece, of several, and of more than a device's buffers hold at a time.
TEST_P(Memory, CopiesInPieces) {
  for (const size_t bytes :
       {(size_t{9} << 20) + 1, (size_t{50} << 20) - 7, (size_t{70} << 20) + 3}) {
    std::vector<uint8_t> values(bytes);
    for (size_t i = 0; i < bytes; ++i) values[i] = uint8_t(i % 251);  // repeats at no power of two
    const auto copy = backend_->Upload(std::span<const uint8_t>(values));
    EXPECT_TRUE(backend_->Download(copy.data(), bytes) == values) << bytes;
  }
}

// More than a device keeps ready for arrivals, so that some are copied when they are waited for.
TEST_P(Memory, SendsToTheHost) {
  constexpr int kSent = 20;
  constexpr size_t kBytes = (size_t{4} << 20) - 3;
  // Large copies and arrivals share memory, and must not hurt each other.
  const auto large = UniformVector(rng_, 3 << 20, -1, 1);
  const auto on_backend = backend_->Upload(std::span<const float>(large));
  std::vector<Buffer<uint8_t>> buffers;
  std::vector<std::unique_ptr<Arrival>> arrivals;
  for (int i = 0; i < kSent; ++i) {
    buffers.push_back(backend_->Allocate<uint8_t>(kBytes));
    backend_->Fill(buffers.back().data(), i + 1, kBytes);
    arrivals.push_back(backend_->SendToHost(buffers.back().data(), kBytes));
  }
  EXPECT_EQ(backend_->Download(on_backend.data(), large.size()), large);
  backend_->CopyToDevice(on_backend.data(), large.data(), large.size() * sizeof(float));
  for (int i = kSent - 1; i >= 0; --i) {
    if (i % 5 == 0) {  // nobody wants it
      arrivals[size_t(i)].reset();
      continue;
    }
    const auto* const host = static_cast<const uint8_t*>(arrivals[size_t(i)]->Wait());
    EXPECT_EQ(std::count(host, host + kBytes, uint8_t(i + 1)), std::ptrdiff_t(kBytes));
  }
  arrivals.clear();
  EXPECT_EQ(backend_->Download(on_backend.data(), large.size()), large);
}

TEST_P(Memory, TakesNothing) {
  backend_->SendToHost(nullptr, 0)->Wait();
  const auto buffer = backend_->Allocate<float>(0);
  EXPECT_TRUE(backend_->Download(buffer.data(), 0).empty());
}

TEST_P(Memory, ModelKeepsItsCoefficients) {
  const TestModel model = RandomModel(rng_, 100, 2);
  const auto uploaded = backend_->blend().UploadModel(model.arrays());
  EXPECT_EQ(uploaded->count(), 100);
  EXPECT_EQ(uploaded->num_sh_coeffs(), 9);
  EXPECT_EQ(backend_->Download<float>(uploaded->sh(), model.sh.size()), model.sh);
}

TEST_P(Memory, RefusesBadArguments) {
  const TestModel model = RandomModel(rng_, 3);
  const auto uploaded = backend_->blend().UploadModel(model.arrays());
  CameraParams camera = TestCamera(16, 16);
  const auto view = backend_->blend().PrepareView(*uploaded, camera);
  std::vector<float> host(16 * 16 * 9);
  EXPECT_THROW(
      backend_->blend().Blend(*view, {host.data(), 9, nullptr, host.data(), nullptr, false}),
      std::invalid_argument);
  EXPECT_THROW(backend_->blend().BlendTranspose(*view, {host.data(), 0, host.data()}),
               std::invalid_argument);
  EXPECT_THROW(backend_->blend().Restrict(*view, nullptr, 0, -1), std::invalid_argument);
  EXPECT_THROW(backend_->blend().GatherRows(*view, host.data(), 0, host.data()),
               std::invalid_argument);
  EvalShParams eval{};
  eval.stride = 2;
  EXPECT_THROW(backend_->sh().EvalSh(*uploaded, eval), std::invalid_argument);
  for (const int k : {0, 5, 25}) {
    EXPECT_THROW(backend_->solve().AddRidge({nullptr, nullptr, 0, k, {}}), std::invalid_argument);
    EXPECT_THROW(backend_->solve().RidgeTerm({nullptr, nullptr, nullptr, nullptr, 0, k, {}}),
                 std::invalid_argument);
    EXPECT_THROW(backend_->solve().FactorBlocks({nullptr, 0, k}), std::invalid_argument);
    EXPECT_THROW(backend_->solve().SolveBlocks({nullptr, nullptr, nullptr, 0, k}),
                 std::invalid_argument);
  }
  EXPECT_THROW(backend_->solve().Adam({}), std::invalid_argument);  // its steps count from 1
  EXPECT_THROW(backend_->solve().Dot(nullptr, nullptr, -1), std::invalid_argument);
  GaussianArrays none = model.arrays();
  none.sh_degree = 4;
  EXPECT_THROW(backend_->blend().UploadModel(none), std::invalid_argument);
  camera.width = 0;
  EXPECT_THROW(backend_->blend().PrepareView(*uploaded, camera), std::invalid_argument);
}

RETINT_INSTANTIATE(Memory);

}  // namespace
}  // namespace retint
