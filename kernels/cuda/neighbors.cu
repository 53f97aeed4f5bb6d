// SPDX-License-Identifier: BSD-3-Clause
// Distances to the nearest points, by tiles. A block compares its points with a tile of others only
// if the tile's box is nearer than the farthest neighbor that one of its points has so far.
// Neighbors in a depth map are neighbors in memory, so few tiles remain.
#include "kernels/cuda/device.cuh"
#include "kernels/cuda/groups.cuh"

namespace retint::cuda {
namespace {

constexpr int kTilePoints = 128;

struct Box {
  float3 low, high;
};

__device__ float3 PointAt(const float* points, int64_t i) {
  return {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
}

// As the host adds it, without fused operations; rounding is monotonic, so a box is never farther
// than a point in it.
__device__ float SquaredLength(float x, float y, float z) {
  return __fadd_rn(__fadd_rn(__fmul_rn(x, x), __fmul_rn(y, y)), __fmul_rn(z, z));
}

__device__ float SquaredDistance(const float3& a, const float3& b) {
  return SquaredLength(__fsub_rn(a.x, b.x), __fsub_rn(a.y, b.y), __fsub_rn(a.z, b.z));
}

__device__ float SquaredDistance(const Box& box, const float3& p) {
  const auto outside = [](float low, float high, float x) {
    return fmaxf(fmaxf(__fsub_rn(low, x), __fsub_rn(x, high)), 0.0f);
  };
  return SquaredLength(outside(box.low.x, box.high.x, p.x), outside(box.low.y, box.high.y, p.y),
                       outside(box.low.z, box.high.z, p.z));
}

// A warp a tile.
__global__ void BoxesKernel(const float* points, int64_t count, int num_tiles, Box* boxes) {
  const int tile = int((blockIdx.x * blockDim.x + threadIdx.x) / 32), lane = threadIdx.x % 32;
  if (tile >= num_tiles) return;
  const int64_t begin = int64_t(tile) * kTilePoints;
  Box box{PointAt(points, begin), PointAt(points, begin)};
  for (int64_t i = begin + lane; i < begin + kTilePoints && i < count; i += 32) {
    const float3 p = PointAt(points, i);
    box.low = {fminf(box.low.x, p.x), fminf(box.low.y, p.y), fminf(box.low.z, p.z)};
    box.high = {fmaxf(box.high.x, p.x), fmaxf(box.high.y, p.y), fmaxf(box.high.z, p.z)};
  }
  for (int offset = 16; offset > 0; offset /= 2) {
    for (float* value : {&box.low.x, &box.low.y, &box.low.z}) {
      *value = fminf(*value, __shfl_xor_sync(kFullWarp, *value, offset));
    }
    for (float* value : {&box.high.x, &box.high.y, &box.high.z}) {
      *value = fmaxf(*value, __shfl_xor_sync(kFullWarp, *value, offset));
    }
  }
  if (lane == 0) boxes[tile] = box;
}

// A thread a point; its kKept nearest so far, itself among them, stay sorted in registers. Tiles
// are visited from its own outwards.
template <int kKept>
__global__ void __launch_bounds__(kTilePoints)
    DistancesKernel(NeighborDistancesParams params, int num_tiles, const Box* boxes) {
  __shared__ float3 tile[kTilePoints];
  const int own = int(blockIdx.x), thread = int(threadIdx.x);
  const int64_t point = int64_t(own) * kTilePoints + thread;
  const bool is_point = point < params.count;
  const float3 p = PointAt(params.points, is_point ? point : params.count - 1);
  float kept[kKept];
#pragma unroll
  for (float& squared : kept) squared = INFINITY;
  const int reach = max(own, num_tiles - 1 - own);
  for (int step = 0; step <= 2 * reach; ++step) {
    const int other = step % 2 ? own + (step + 1) / 2 : own - step / 2;
    if (other < 0 || other >= num_tiles) continue;
    const bool may = is_point && SquaredDistance(boxes[other], p) < kept[kKept - 1];
    if (!__syncthreads_or(may)) continue;
    const int64_t begin = int64_t(other) * kTilePoints;
    const int filled = int(min(int64_t(kTilePoints), params.count - begin));
    if (thread < filled) tile[thread] = PointAt(params.points, begin + thread);
    __syncthreads();
    for (int j = 0; may && j < filled; ++j) {
      const float squared = SquaredDistance(p, tile[j]);
      if (!(squared < kept[kKept - 1])) continue;
#pragma unroll
      for (int k = kKept - 1; k > 0; --k) {
        kept[k] = squared < kept[k - 1] ? kept[k - 1] : fminf(squared, kept[k]);
      }
      kept[0] = fminf(squared, kept[0]);
    }
  }
  if (!is_point) return;
  double sum = 0;
#pragma unroll
  for (int k = 1; k < kKept; ++k) {
    if (k <= params.neighbors) sum += double(sqrtf(kept[k]));
  }
  params.distances[point] = float(sum / params.neighbors);
}

class CudaNeighborOps : public NeighborOps {
 public:
  explicit CudaNeighborOps(cudaStream_t stream) : stream_(stream) {}
  void DoNeighborDistances(const NeighborDistancesParams& params) override;

 private:
  cudaStream_t stream_;
};

void CudaNeighborOps::DoNeighborDistances(const NeighborDistancesParams& params) {
  constexpr int kUsual = 16;
  const int num_tiles = int((params.count + kTilePoints - 1) / kTilePoints);
  const Scratch<Box> boxes(stream_, size_t(num_tiles));
  BoxesKernel<<<Blocks(int64_t(num_tiles) * 32, 256), 256, 0, stream_>>>(
      params.points, params.count, num_tiles, boxes.data());
  Check(cudaGetLastError(), "BoxesKernel");
  const auto kernel =
      params.neighbors <= kUsual ? DistancesKernel<kUsual + 1> : DistancesKernel<kMaxNeighbors + 1>;
  kernel<<<num_tiles, kTilePoints, 0, stream_>>>(params, num_tiles, boxes.data());
  Check(cudaGetLastError(), "DistancesKernel");
}

}  // namespace

std::unique_ptr<NeighborOps> MakeNeighborOps(cudaStream_t stream) {
  return std::make_unique<CudaNeighborOps>(stream);
}

}  // namespace retint::cuda
