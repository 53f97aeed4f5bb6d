// SPDX-License-Identifier: BSD-3-Clause
// The numeric kernels' front door. A backend owns memory (kernels/device.h) and hands out groups of
// operations on it, a header each. The CPU backend is the oracle for every other one.
//
// Every operation checks its arguments first, in the same way for every backend. Impossible
// arguments (channels beyond kMaxChannels, a box outside its image, a region if a whole view is
// needed) throw std::invalid_argument. Images are [H, W, C] floats, row-major. Results do not
// depend on the number of threads. An operation returns when its result may be read through
// Download, or earlier on an asynchronous backend, in stream order. Thread-safe.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/blend_ops.h"
#include "kernels/device.h"
#include "kernels/graph_ops.h"
#include "kernels/mask_ops.h"
#include "kernels/neighbor_ops.h"
#include "kernels/refit_ops.h"
#include "kernels/sh_ops.h"
#include "kernels/solve_ops.h"
#include "kernels/stereo_ops.h"

namespace retint {

class Backend : public Device {
 public:
  virtual std::string_view Name() const = 0;    // "cpu", "cuda"
  virtual std::string Description() const = 0;  // "AVX-512 (Highway), 2 threads"

  // The groups live as long as the backend.
  BlendOps& blend() { return *blend_; }
  ShOps& sh() { return *sh_; }
  SolveOps& solve() { return *solve_; }
  RefitOps& refit() { return *refit_; }
  MaskOps& mask() { return *mask_; }
  StereoOps& stereo() { return *stereo_; }
  // Optional: null where the backend has none.
  NeighborOps* neighbors() { return neighbors_.get(); }
  GraphOps* graph() { return graph_.get(); }

 protected:
  // Set by the backend's constructor.
  std::unique_ptr<BlendOps> blend_;
  std::unique_ptr<ShOps> sh_;
  std::unique_ptr<SolveOps> solve_;
  std::unique_ptr<RefitOps> refit_;
  std::unique_ptr<MaskOps> mask_;
  std::unique_ptr<StereoOps> stereo_;
  std::unique_ptr<NeighborOps> neighbors_;
  std::unique_ptr<GraphOps> graph_;
};

// "cpu", and "cuda" where built and a device is present.
std::vector<std::string> AvailableBackends();
// Why "cuda" cannot be used here: not built in, no driver, no device, too old a device. Empty where
// it can.
inline constexpr std::string_view kCudaNotBuiltIn = "not built in";
std::string CudaFault();
// `name` is "auto", "cpu" or "cuda"; "auto" is cuda where it can be used, else cpu. Throws
// std::invalid_argument, with the fault, for an unknown or unavailable one.
std::shared_ptr<Backend> CreateBackend(std::string_view name);

}  // namespace retint
