// SPDX-License-Identifier: BSD-3-Clause
// The stages of kernels/stereo_ops.h on a stream.
#pragma once

#include "kernels/cuda/device.cuh"
#include "kernels/stereo_ops.h"

namespace retint::cuda {

void MatchStereo(const StereoMatchParams& params, cudaStream_t stream);
void ArbitrateStereo(const StereoArbitrateParams& params, cudaStream_t stream);
void RefineStereo(const StereoRefineParams& params, cudaStream_t stream);

// Border modes of image filters: ... 2 1 0 1 2 ... and ... 0 0 0 1 2 ...
__device__ inline int Clamped(int x, int size) { return x < 0 ? 0 : x >= size ? size - 1 : x; }
__device__ inline int Reflected(int x, int size) {
  if (size == 1) return 0;
  while (x < 0 || x >= size) x = x < 0 ? -x : 2 * size - 2 - x;
  return x;
}

// Thread blocks of 32 x 8 pixels.
inline constexpr int kBlockX = 32, kBlockY = 8;
inline dim3 PixelBlocks(int width, int height) {
  return dim3(Blocks(width, kBlockX), Blocks(height, kBlockY));
}
inline dim3 PixelThreads() { return dim3(kBlockX, kBlockY); }

}  // namespace retint::cuda
