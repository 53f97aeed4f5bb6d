// SPDX-License-Identifier: BSD-3-Clause
// Projects, culls and sorts by (depth, index).
#include <stdexcept>
#include <string>
#include <utility>

#include "kernels/cuda/ordered_scan.cuh"
#include "kernels/cuda/tile_lists.cuh"

namespace retint::cuda {
namespace {

constexpr int kThreads = 256;

__global__ void ActivateKernel(int64_t count, const float* means, const float* quats,
                               const float* log_scales, const float* logits, float4* mean_opacity,
                               Covariance3* covariances) {
  const int64_t g = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (g >= count) return;
  covariances[g] = CovarianceOf(quats + 4 * g, log_scales + 3 * g);
  mean_opacity[g] = {means[3 * g], means[3 * g + 1], means[3 * g + 2], Sigmoid(logits[g])};
}

// Of a CudaModel.
struct Gaussians {
  const float4* mean_opacity;
  const Covariance3* covariances;
  bool compensate;
};

// Behind every depth, which is positive and finite: invisible Gaussians sort last.
constexpr uint32_t kBehindAll = 0x7fffffff;

// The outputs of ProjectKernel. Rows are the visible Gaussians, ascending.
struct Projected {
  Splat* splats;       // [rows]
  int32_t* gaussians;  // [rows]
  BinBox* boxes;       // [rows]
  uint32_t* depths;    // [N] of the rows as sortable bits, then of invisible Gaussians
  int32_t* rows;       // [N] 0 to rows - 1, then anything
  ViewTotals* totals;  // entries: of the lists of bins
};

__global__ void __launch_bounds__(kThreads)
    ProjectKernel(int64_t count, CameraParams camera, Gaussians model, ScanState scan,
                  Projected out) {
  const int64_t g = int64_t(blockIdx.x) * kThreads + threadIdx.x;
  Splat splat;
  BinBox box{};
  bool visible = false;
  if (g < count) {
    const float4 mean_opacity = model.mean_opacity[g];
    const float2* const from = reinterpret_cast<const float2*>(model.covariances + g);
    const float2 xx_xy = from[0], xz_yy = from[1], yz_zz = from[2];
    if (ProjectGaussian(camera, {mean_opacity.x, mean_opacity.y, mean_opacity.z},
                        {xx_xy.x, xx_xy.y, xz_yy.x, xz_yy.y, yz_zz.x, yz_zz.y}, mean_opacity.w,
                        model.compensate, &splat)) {
      const Ellipse ellipse = EllipseOf(splat);
      splat.half_height = ellipse.half_height;
      visible = BoundingBins(TileGrid(camera), ellipse, &box);
    }
  }
  const int64_t end = scan.InclusiveSum<kThreads>(visible);
  if (visible) {
    const int64_t r = end - 1;
    float4* const to = reinterpret_cast<float4*>(out.splats + r);
    to[0] = {splat.x, splat.y, splat.a, splat.b};
    to[1] = {splat.c, splat.log2_opacity, splat.depth, splat.half_height};
    out.gaussians[r] = int32_t(g);
    out.boxes[r] = box;
    out.depths[r] = __float_as_uint(splat.depth);
    out.rows[r] = int32_t(r);
  } else if (g < count) {
    out.depths[count - 1 - (g - end)] = kBehindAll;
  }
  out.totals->AddFromBlock(visible, visible ? unsigned(box.count()) : 0);
}

// Depths are sorted without their last bits, a pass less. This puts those that only these tell
// apart in order: `order` and `sorted` are stable, so that of equal ones the first index is first.
// It takes time with the square of how many agree in the others: of many Gaussians all bits are
// sorted.
constexpr int kSkippedBits = 7;
constexpr int64_t kMostSettled = int64_t{1} << 18;
__global__ void SettleOrderKernel(int64_t rows, const uint32_t* sorted, const int32_t* order,
                                  int32_t* settled) {
  const int64_t r = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (r >= rows) return;
  const uint32_t depth = sorted[r], leading = depth >> kSkippedBits;
  int64_t to = r;
  for (int64_t i = r; i > 0; --i) {
    const uint32_t before = sorted[i - 1];
    if (before >> kSkippedBits != leading) break;
    if (before > depth) --to;
  }
  for (int64_t i = r + 1; i < rows; ++i) {
    const uint32_t behind = sorted[i];
    if (behind >> kSkippedBits != leading) break;
    if (behind < depth) ++to;
  }
  settled[to] = order[r];
}

// The first `count` of an array that was made for more, in memory of its own if much is left.
template <typename T>
Scratch<T> FirstOf(Scratch<T> all, int64_t count, cudaStream_t stream) {
  if (4 * size_t(count) >= 3 * all.size()) return all;
  Scratch<T> first(stream, size_t(count));
  Check(cudaMemcpyAsync(first.data(), all.data(), first.bytes(), cudaMemcpyDeviceToDevice, stream),
        "cudaMemcpyAsync");
  return first;
}

__global__ void TellKernel(const ViewTotals* totals, ViewTotals* host) {
  host->rows = totals->rows;
  host->entries = totals->entries;
  __threadfence_system();
  *static_cast<volatile unsigned*>(&host->told) = 1;
}

}  // namespace

void Tell(const ViewTotals* totals, const HostWords<ViewTotals>& host, cudaStream_t stream) {
  TellKernel<<<1, 1, 0, stream>>>(totals, host.device());
  Check(cudaGetLastError(), "TellKernel");
}

std::unique_ptr<CudaModel> Upload(const GaussianArrays& host, cudaStream_t stream) {
  auto model = std::make_unique<CudaModel>(host);
  const size_t n = size_t(host.count), k = size_t(model->num_sh_coeffs());
  const auto copy = [&](const float* from, size_t count) {
    Scratch<float> to(stream, count);
    Check(cudaMemcpyAsync(to.data(), from, count * sizeof(float), cudaMemcpyHostToDevice, stream),
          "cudaMemcpyAsync");
    return to;
  };
  model->means = copy(host.means, 3 * n);
  model->coefficients = copy(host.sh, 3 * k * n);
  const auto quats = copy(host.quats_wxyz, 4 * n), scales = copy(host.log_scales, 3 * n);
  const auto logits = copy(host.opacity_logits, n);
  model->mean_opacity = Scratch<float4>(stream, n);
  model->covariances = Scratch<Covariance3>(stream, n);
  if (n > 0) {
    ActivateKernel<<<Blocks(host.count, kThreads), kThreads, 0, stream>>>(
        host.count, model->means.data(), quats.data(), scales.data(), logits.data(),
        model->mean_opacity.data(), model->covariances.data());
    Check(cudaGetLastError(), "ActivateKernel");
  }
  Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  return model;
}

std::shared_ptr<CudaViewGeometry> Prepare(const CudaModel& model, const CameraParams& camera,
                                          cudaStream_t stream) {
  auto view = std::make_shared<CudaViewGeometry>(stream);
  view->SetShape(camera, 0);
  const BinGrid bins{TileGrid(camera)};
  if (bins.columns > kMostBins || bins.rows > kMostBins) {
    throw std::length_error("an image of " + std::to_string(camera.width) + "x" +
                            std::to_string(camera.height) +
                            " pixels is too large for the GPU: at most 32768x16384 fit");
  }
  view->ranges = Scratch<int2>(stream, size_t(view->tiles_x() * view->tiles_y()));
  const auto without_rows = [&] {
    Check(cudaMemsetAsync(view->ranges.data(), 0, view->ranges.bytes(), stream), "cudaMemsetAsync");
    return view;
  };
  const int64_t n = model.count();
  if (n == 0) return without_rows();

  const unsigned blocks = Blocks(n, kThreads);
  Scratch<Splat> splats(stream, size_t(n));
  Scratch<int32_t> gaussians(stream, size_t(n));
  // One piece of memory each for arrays that end together: taking it is a part of a small view's
  // time.
  const Scratch<int32_t> of_rows(stream, 2 * size_t(n));
  int32_t *const rows = of_rows.data(), *const order = rows + n;
  const Scratch<uint32_t> of_depths(stream, 3 * size_t(n));
  uint32_t *const depths = of_depths.data(), *const sorted = depths + n;
  auto* const boxes = reinterpret_cast<BinBox*>(sorted + n);
  static_assert(sizeof(ViewCounts) % sizeof(unsigned long long) == 0);
  constexpr size_t kCountsWords = sizeof(ViewCounts) / sizeof(unsigned long long);
  const Scratch<unsigned long long> zeroes(stream, kCountsWords + blocks);
  Check(cudaMemsetAsync(zeroes.data(), 0, zeroes.bytes(), stream), "cudaMemsetAsync");
  auto* const counts = reinterpret_cast<ViewCounts*>(zeroes.data());
  ProjectKernel<<<blocks, kThreads, 0, stream>>>(
      n, camera, {model.mean_opacity.data(), model.covariances.data(), model.compensate()},
      ScanState(zeroes.data() + kCountsWords),
      {splats.data(), gaussians.data(), boxes, depths, rows, &counts->projected});
  Check(cudaGetLastError(), "ProjectKernel");
  const HostWords<ViewTotals> totals;
  Tell(&counts->projected, totals, stream);
  const bool settles = n <= kMostSettled;
  // All are sorted, so that the host need not wait for the number of visible ones first.
  WithTemporary(stream, "cub::DeviceRadixSort", [&](void* memory, size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(memory, bytes, depths, sorted, rows, order, n,
                                           settles ? kSkippedBits : 0, 31, stream);
  });
  const ViewTotals found = totals.Wait(stream, &ViewTotals::told);
  const int64_t visible = found.rows, bin_entries = int64_t(found.entries);
  if (visible == 0) return without_rows();
  if (bin_entries > INT32_MAX) {
    throw std::length_error("the view's lists have " + std::to_string(bin_entries) +
                            " entries, more than 2^31");
  }
  view->SetShape(camera, visible);
  if (settles) {
    SettleOrderKernel<<<Blocks(visible, kThreads), kThreads, 0, stream>>>(visible, sorted, order,
                                                                          rows);
    Check(cudaGetLastError(), "SettleOrderKernel");
  }
  view->gaussians = FirstOf(std::move(gaussians), visible, stream);
  view->splats = FirstOf(std::move(splats), visible, stream);
  MakeTileLists(settles ? rows : order, boxes, bin_entries, counts, view.get(), stream);
  return view;
}

}  // namespace retint::cuda
