// SPDX-License-Identifier: BSD-3-Clause
// Conjugate gradients over a graph, all iterations in one cooperative kernel: the host neither
// starts them one by one nor asks whether they have converged.
#include <algorithm>
#include <tuple>

#include <cooperative_groups.h>

#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/scan.cuh"

namespace retint::cuda {
namespace {

namespace cg = cooperative_groups;

constexpr int kThreads = 1024;  // few blocks, since all of them wait for each other
constexpr int kRowLanes = 8;    // side by side, they share the edges of a node
constexpr int kSums = 3;

// Vectors of the iteration, [nodes] each: the residual, its product (scaled) with the matrix, the
// direction, the direction's product, the diagonal and 1 / it, and the residual scaled by that.
// That one is read at random, and as floats, rounded before anything is made of them, it fits the
// cache better.
struct Vectors {
  double *residual, *product, *direction, *applied, *diagonal, *inverse;
  float* scaled;
};

// sum_e w_e value(other) over the edges of `row`; the same for all lanes of the row.
template <typename Value>
__device__ double SumRow(const SolveGraphParams& params, int row, const Value& value) {
  double sum = 0;
  const int end = params.begin[row + 1];
  for (int e = params.begin[row] + int(threadIdx.x) % kRowLanes; e < end; e += kRowLanes) {
    sum += double(params.weight[e]) * value(params.other[e]);
  }
  for (int offset = kRowLanes / 2; offset > 0; offset /= 2) {
    sum += __shfl_xor_sync(kFullWarp, sum, offset);
  }
  return sum;
}

// Leaves the block's sums of `values` in parts, [kSums, blocks].
__device__ void StoreParts(const double (&values)[kSums], double* parts) {
  for (int k = 0; k < kSums; ++k) {
    const double sum = SumOverBlock(values[k]);
    if (threadIdx.x == 0) parts[k * gridDim.x + blockIdx.x] = sum;
  }
}

// The sums of all blocks' parts, in their order, for every thread: a warp each.
__device__ void LoadSums(const double* parts, double (&sums)[kSums]) {
  static_assert(kSums * 32 <= kThreads);
  __shared__ double shared[kSums];
  const int warp = int(threadIdx.x) / 32, lane = int(threadIdx.x) % 32;
  __syncthreads();
  if (warp < kSums) {
    double sum = 0;
    for (unsigned i = lane; i < gridDim.x; i += 32) sum += __ldcg(parts + warp * gridDim.x + i);
    for (int offset = 16; offset > 0; offset /= 2) sum += __shfl_xor_sync(kFullWarp, sum, offset);
    if (lane == 0) shared[warp] = sum;
  }
  __syncthreads();
  for (int k = 0; k < kSums; ++k) sums[k] = shared[k];
}

__global__ void __launch_bounds__(kThreads)
    SolveKernel(SolveGraphParams params, Vectors v, double* parts, int* iterations) {
  cg::grid_group grid = cg::this_grid();
  const int nodes = int(params.nodes);
  const int thread = int(blockIdx.x * kThreads + threadIdx.x), threads = int(gridDim.x) * kThreads;
  const int first_row = thread / kRowLanes, rows = threads / kRowLanes;
  const bool is_first = threadIdx.x % kRowLanes == 0;
  // Whole warps stay together: past the end they have a row without a result.
  const int last_row = (nodes + 3) / 4 * 4;

  double own[kSums] = {};
  for (int row = first_row; row < last_row; row += rows) {
    const int at = min(row, nodes - 1);
    const double of_x = SumRow(params, at, [&](int other) { return params.x[other]; });
    const double of_weights = SumRow(params, at, [](int) { return 1.0; });
    if (!is_first || row >= nodes) continue;
    const double pull = params.pull[row], diagonal = params.trust[row] + of_weights;
    v.residual[row] = pull - (diagonal * params.x[row] - of_x);
    v.diagonal[row] = diagonal;
    v.inverse[row] = 1 / diagonal;
    v.scaled[row] = float(v.residual[row] / diagonal);
    own[0] += pull * pull;
  }
  StoreParts(own, parts);
  grid.sync();
  double sums[kSums];
  LoadSums(parts, sums);
  const double limit = sums[0] * params.tolerance * params.tolerance;
  grid.sync();

  double gamma_before = 0, alpha = 0;
  int iteration = 0;
  for (;; ++iteration) {
    double mine[kSums] = {};
    for (int row = first_row; row < last_row; row += rows) {
      const int at = min(row, nodes - 1);
      const double of_scaled =
          SumRow(params, at, [&](int other) { return double(v.scaled[other]); });
      if (!is_first || row >= nodes) continue;
      const double scaled = v.scaled[row], residual = v.residual[row];
      const double product = scaled * v.diagonal[row] - of_scaled;
      v.product[row] = product;
      mine[0] += residual * scaled;
      mine[1] += product * scaled;
      mine[2] += residual * residual;
    }
    StoreParts(mine, parts);
    grid.sync();
    LoadSums(parts, sums);
    const double gamma = sums[0];
    const bool is_start = iteration == 0;
    const double beta = is_start ? 0 : gamma / gamma_before;
    alpha = gamma / (is_start ? sums[1] : sums[1] - beta * gamma / alpha);
    gamma_before = gamma;
    // The same for every thread, so that all leave together.
    if (!(sums[2] > limit) || iteration == params.max_iterations || !isfinite(alpha)) break;
    for (int i = thread; i < nodes; i += threads) {
      const double direction = double(v.scaled[i]) + (is_start ? 0 : beta * v.direction[i]);
      const double applied = v.product[i] + (is_start ? 0 : beta * v.applied[i]);
      v.direction[i] = direction;
      v.applied[i] = applied;
      params.x[i] += alpha * direction;
      const double residual = v.residual[i] - alpha * applied;
      v.residual[i] = residual;
      v.scaled[i] = float(residual * v.inverse[i]);
    }
    grid.sync();
  }
  if (thread == 0) *iterations = iteration;
}

class CudaGraphOps : public GraphOps {
 public:
  explicit CudaGraphOps(cudaStream_t stream) : stream_(stream) {}
  void DoWeighEdges(const WeighEdgesParams& params) override;
  int DoSolveGraph(const SolveGraphParams& params) override;

 private:
  cudaStream_t stream_;
};

// As many blocks as the device runs at a time, since they wait for each other.
unsigned BlocksTogether() {
  int device = 0, processors = 0, blocks = 0;
  Check(cudaGetDevice(&device), "cudaGetDevice");
  Check(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device),
        "cudaDeviceGetAttribute");
  Check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, SolveKernel, kThreads, 0),
        "cudaOccupancyMaxActiveBlocksPerMultiprocessor");
  return unsigned(processors * blocks);
}

void CudaGraphOps::DoWeighEdges(const WeighEdgesParams& params) {
  // A row's lanes are side by side, so that they read its edges together.
  ForEach(params.nodes * kRowLanes, stream_, "WeighEdges", [=] __device__(int64_t i) {
    const int64_t row = i / kRowLanes;
    const NodeLook look = params.looks[row];
    for (int e = params.begin[row] + int(i % kRowLanes); e < params.begin[row + 1];
         e += kRowLanes) {
      const float weight = WeightBetween(look, params.looks[params.other[e]], params.weight[e]);
      params.out[e] = params.scale * (weight + params.least);
    }
  });
}

int CudaGraphOps::DoSolveGraph(const SolveGraphParams& params) {
  if (params.nodes == 0) return 0;
  const unsigned blocks = BlocksUpTo(BlocksTogether(), params.nodes * kRowLanes, kThreads);
  const auto nodes = size_t(params.nodes);
  const Scratch<float> scaled(stream_, nodes);
  const Scratch<double> memory(stream_, 6 * nodes), parts(stream_, size_t(kSums) * blocks);
  const Scratch<int> iterations(stream_, 1);
  double* const at = memory.data();
  Vectors vectors{
      at,           at + nodes, at + 2 * nodes, at + 3 * nodes, at + 4 * nodes, at + 5 * nodes,
      scaled.data()};
  SolveGraphParams given = params;
  double* parts_at = parts.data();
  int* iterations_at = iterations.data();
  void* arguments[] = {&given, &vectors, &parts_at, &iterations_at};
  Check(
      cudaLaunchCooperativeKernel(SolveKernel, dim3(blocks), dim3(kThreads), arguments, 0, stream_),
      "SolveGraph");
  return std::get<0>(ReadBack(stream_, iterations.data()));
}

}  // namespace

std::unique_ptr<GraphOps> MakeGraphOps(cudaStream_t stream) {
  return std::make_unique<CudaGraphOps>(stream);
}

}  // namespace retint::cuda
