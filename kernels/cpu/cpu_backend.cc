// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cpu/cpu_backend.h"

#include <cstring>
#include <string>

#include <tbb/global_control.h>

#include "kernels/cpu/groups.h"
#include "kernels/cpu/memory.h"

namespace retint {
namespace {

class CpuBackend : public Backend {
 public:
  explicit CpuBackend(const CpuOptions& options)
      : target_(options.scalar ? "scalar" : std::string(SimdTargetName()) + " (Highway)") {
    blend_ = MakeCpuBlendOps(options.scalar ? ScalarTileKernels() : SimdTileKernels());
    sh_ = MakeCpuShOps(options.scalar ? EditColorsOneByOne : EditColors);
    solve_ = MakeCpuSolveOps();
    refit_ = MakeCpuRefitOps(*blend_, options.scalar ? ScalarLossKernels() : SimdLossKernels(),
                             options.scalar ? ScalarTileKernels() : SimdTileKernels(),
                             options.scalar ? EditColorsOneByOne : EditColors);
    mask_ = MakeCpuMaskOps();
    stereo_ = MakeCpuStereoOps(options.scalar ? ScalarStereoKernels() : SimdStereoKernels());
  }

  std::string_view Name() const override { return "cpu"; }
  std::string Description() const override {
    const size_t threads =
        tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return target_ + ", " + std::to_string(threads) + (threads == 1 ? " thread" : " threads");
  }

  std::shared_ptr<DeviceMemory> AllocateBytes(size_t bytes) override { return AllocateHost(bytes); }
  void CopyToDevice(void* device, const void* host, size_t bytes) override {
    if (bytes > 0) std::memcpy(device, host, bytes);
  }
  void CopyToHost(void* host, const void* device, size_t bytes) override {
    if (bytes > 0) std::memcpy(host, device, bytes);
  }
  void Fill(void* device, int byte, size_t bytes) override {
    if (bytes > 0) std::memset(device, byte, bytes);
  }
  void Synchronize() override {}
  size_t PeakDeviceBytes() const override { return 0; }
  size_t AvailableDeviceBytes() const override { return 0; }
  bool IsHost() const override { return true; }

 private:
  std::string target_;
};

}  // namespace

std::shared_ptr<Backend> CreateCpuBackend(const CpuOptions& options) {
  return std::make_shared<CpuBackend>(options);
}

}  // namespace retint
