// SPDX-License-Identifier: BSD-3-Clause
// The one interface of the numeric kernels. A backend owns memory (host for "cpu", device for
// "cuda") and runs named operations on it. The CPU backend is the oracle for every other one.
//
// With geometry frozen, a render of view v is linear in the per-Gaussian features: y = W_v c,
// W_v[p,g] = alpha_g(p) T_g(p) (3DGS blending, front to back). Blend applies W_v, BlendTranspose
// applies W_v^T; everything else hangs on these two.
//
// Rows. A ViewGeometry lists the Gaussians that reach the image, sorted by (depth, index).
// Per-Gaussian arrays of the operations below are indexed by *row*: entry r speaks of Gaussian
// rows()[r]. For a whole view, a row is a visible Gaussian. For a region (Restrict) a row is a
// visible *active* Gaussian; the others still attenuate, but carry no feature, so Blend gives W_A
// c_A and BlendTranspose gives W_A^T r, on the region's tiles only.
//
// Images are [H, W, C] floats, row-major. Results do not depend on the number of threads. Every
// operation returns when its result may be read through Download, or earlier on an asynchronous
// backend, in stream order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/common/types.h"

namespace retint {

enum class Op {
  kPrepareView,
  kRestrict,
  kBlend,
  kBlendTranspose,
  kDepth,
  kEvalSh,
  kEvalShTranspose,
  kImageLoss,
  kAdam,
  kAccumulateBlocks,
  kSolveBlocks,
  kNeighborDistances,
};

// Untyped memory of a backend; freed with the last reference.
class DeviceMemory {
 public:
  virtual ~DeviceMemory() = default;
  void* data() const { return data_; }
  size_t bytes() const { return bytes_; }

 protected:
  DeviceMemory(void* data, size_t bytes) : data_(data), bytes_(bytes) {}
  void* data_;
  size_t bytes_;
};

// Typed handle of backend memory. Copies share the memory.
template <typename T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(std::shared_ptr<DeviceMemory> memory, size_t count)
      : memory_(std::move(memory)), count_(count) {}
  T* data() const { return memory_ ? static_cast<T*>(memory_->data()) : nullptr; }
  size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }

 private:
  std::shared_ptr<DeviceMemory> memory_;
  size_t count_ = 0;
};

// An uploaded model. The SH coefficients may be rewritten (sh()), the geometry is frozen.
class Model {
 public:
  virtual ~Model() = default;
  int64_t count() const { return count_; }
  int sh_degree() const { return sh_degree_; }
  int num_sh_coeffs() const { return (sh_degree_ + 1) * (sh_degree_ + 1); }
  virtual float* sh() = 0;  // backend memory, [N, K, 3]
  virtual const float* sh() const = 0;

 protected:
  int64_t count_ = 0;
  int sh_degree_ = 0;
};

// The frozen geometry of one view (or of a region of it): rows, conics, sorted tile lists.
// Immutable; cache and share it.
class ViewGeometry {
 public:
  virtual ~ViewGeometry() = default;
  const CameraParams& camera() const { return camera_; }
  int64_t num_rows() const { return num_rows_; }
  // Gaussian index of each row, backend memory, [num_rows]; distinct, in an order of the backend's
  // choosing.
  virtual const int32_t* rows() const = 0;
  virtual size_t bytes() const = 0;  // for cache budgets
  // Tiles this geometry visits (all tiles with Gaussians, or the region's), row-major tile index,
  // host memory.
  virtual std::span<const int32_t> tiles() const = 0;
  // Bit y: row y of every tile has its weights. Only RestrictCompact() leaves rows out, and keeps
  // every second, fourth or eighth; Blend writes zeros there, BlendTranspose does not read them.
  uint16_t pixel_rows() const { return pixel_rows_; }
  int tiles_x() const { return (camera_.width + kTileSize - 1) / kTileSize; }
  int tiles_y() const { return (camera_.height + kTileSize - 1) / kTileSize; }

 protected:
  CameraParams camera_{};
  int64_t num_rows_ = 0;
  uint16_t pixel_rows_ = 0xffff;
};

// `pixel_rows` in what follows: bit y % kTileSize says that rows y are wanted. Backends may leave
// the others out, and with them their cost; what an image then holds there is unspecified.
inline constexpr uint16_t kAllPixelRows = 0xffff;

struct BlendParams {
  const float* features;    // [rows, C]
  int32_t channels;         // C, 1..kMaxChannels
  const float* background;  // [C] or null for zero; y += T_final * background. Ignored for regions.
  float* image;  // [H, W, C]; pixels outside tiles() are left alone when `keep_outside`, else
                 // background
  float* alpha;  // [H, W] = 1 - T_final (a region: W_A 1), or null
  bool keep_outside;
  uint16_t pixel_rows = kAllPixelRows;
};

struct BlendTransposeParams {
  const float* residual;  // [H, W, C]
  int32_t channels;       // C, 1..kMaxChannels
  float* result;          // [rows, C], overwritten: sum over pixels of W[p,row] * residual[p]
  uint16_t pixel_rows = kAllPixelRows;  // `residual` is zero in the others
};

// Expected depth W z / W 1 (0 where W 1 is 0) and median depth: z of the Gaussian at which T
// crosses `threshold` (0 where it never does). z along the viewing axis. Whole views only.
struct DepthParams {
  float* median;    // [H, W] or null
  float* expected;  // [H, W] or null
  float* alpha;     // [H, W] or null
  float threshold;  // 0.5
  uint16_t pixel_rows = kAllPixelRows;
  float min_alpha = 0;  // `expected` is 0 in pixels less opaque
};

// Colour of `count` Gaussians seen from `center`: f = max(0, 0.5 + sum_k Y_k(d) sh_k), d =
// normalised (mean - center). `rows` maps entry to Gaussian (null: identity). `slots`, where given,
// maps entry to the block of `sh` to read, so that compact coefficient arrays of active Gaussians
// work too (null: the Gaussian's index); entries with slot < 0 give 0.
struct EvalShParams {
  const int32_t* rows;   // [count] or null
  const int32_t* slots;  // [count] or null
  int64_t count;
  const float* sh;  // [*, K, 3]
  float center[3];  // camera centre, world
  float* colors;    // [count, stride], of which the first 3 are written
  int32_t stride = 3;
};

// Transpose of EvalSh for a fixed view: gradient[slot, k, :] += Y_k(d) * color_gradient[entry, :].
// Channels whose colour is clamped at 0 (read from `colors`, null: no gate) pass nothing. Entries
// with slot < 0 are skipped; slots are distinct.
struct EvalShTransposeParams {
  const int32_t* rows;   // [count] or null
  const int32_t* slots;  // [count] or null
  int64_t count;
  const float* color_gradients;  // [count, 3]
  const float* colors;           // [count, 3] or null
  float center[3];
  float* gradient;  // [*, K, 3], accumulated
};

// L = (1 - lambda) * mean|y - y*| + lambda * (1 - mean SSIM(y, y*)), SSIM with an 11x11 Gaussian
// window of sigma 1.5, zero padding, C1 = 0.01^2, C2 = 0.03^2, per channel (Wang et al. 2004;
// 3DGS's training loss). Means over all W*H*3 values. With `roi` (x0, y0, x1, y1, pixels,
// half-open) the gradient is written inside it only and the value sums only its pixels, still
// divided by W*H*3: exact wherever y and y* agree outside.
struct ImageLossParams {
  const float* image;   // y [H, W, 3]
  const float* target;  // y* [H, W, 3]
  int32_t width, height;
  float lambda;     // 0.2
  int32_t roi[4];   // all zero: the whole image
  float* gradient;  // dL/dy [H, W, 3]
  // [1] backend memory: the loss is added here and the returned value is empty, so that nobody
  // waits for it. Null: it is returned.
  double* loss = nullptr;
};

struct ImageLossValue {
  double loss, l1, ssim;
};

// Adam (Kingma & Ba 2015) on `count` values: m, v moments, `step` counts from 1.
struct AdamParams {
  float* values;
  const float* gradients;
  float* m;
  float* v;
  int64_t count;
  int64_t step;
  float learning_rate, beta1, beta2, epsilon;
};

// Block normal matrices of the SH fit: block[slot] += weight[entry] * y y^T with y = Y(d) of
// Gaussian rows[entry] seen from `center`. Packed lower triangles, row by row: K (K + 1) / 2 floats
// a block. Slots < 0 are skipped; slots are distinct.
struct AccumulateBlocksParams {
  const int32_t* rows;   // [count]
  const int32_t* slots;  // [count] or null
  int64_t count;
  const float* weights;  // [count]
  float center[3];
  float* blocks;  // [slots, K (K + 1) / 2]
};

// Cholesky of every block in place (ridge already added), then x = block^-1 b, three right-hand
// sides each. A block that is not positive definite gives x = 0.
struct FactorBlocksParams {
  float* blocks;  // [count, K (K + 1) / 2]
  int64_t count;
  int32_t k;  // 1, 4, 9 or 16
};
struct SolveBlocksParams {
  const float* factors;  // from FactorBlocks
  const float* rhs;      // [count, K, 3]
  float* solution;       // [count, K, 3]
  int64_t count;
  int32_t k;
};

// The refit's remaining steps (src/recolor), so that a sweep never leaves backend memory.
//
// y + mask / 255 * (delta y + offset) per RGB triple: ColorEdit with delta = gain - identity.
struct ColorMap {
  float delta[9];  // row-major
  float offset[3];
};

// How a region's pixels should change: target = edited(source) - render, for the tiles of tiles()
// in their order, kTileSize^2 pixels each, row-major (0 past the image's edge), in steps of `unit`,
// saturating.
struct RegionTargetParams {
  const float* render;  // [H, W, 3]
  const float* source;  // [H, W, 3] what is edited; null: `render`
  const uint8_t* mask;  // [H, W]
  ColorMap map;
  float unit;
  int16_t* target;  // [tiles, kTileSize^2, 3]
  // Where not null, also the pixels' weights m inside_weight + (1 - m) outside_weight, m = mask /
  // 255, in steps of 1 / 255: [tiles, kTileSize^2], 0 past the image's edge and in rows that the
  // region left out.
  uint8_t* weights = nullptr;
  float inside_weight = 1, outside_weight = 1;
};

// r = target * unit - image on the region's tiles: residual = weight * r, loss[0] += weight * r^2.
struct RegionResidualParams {
  const int16_t* target;  // [tiles, kTileSize^2, 3]
  float unit;
  const float* image;      // [H, W, 3]
  float* residual;         // [H, W, 3]; may be `image`
  double* loss;            // [1] backend memory, accumulated
  const uint8_t* weights;  // [tiles, kTileSize^2] in steps of 1 / 255, or null: all 1
};

// The derivative of EvalSh along `direction`: tangents = gate * sum_k Y_k(d) direction_k, gate 0
// where `colors` (null: no gate) is not positive. Entries with slot < 0 give 0.
struct ShTangentParams {
  const int32_t* rows;   // [count] or null
  const int32_t* slots;  // [count] or null
  int64_t count;
  const float* direction;  // [*, K, 3]
  const float* colors;     // [count, 3] or null
  float center[3];
  float* tangents;  // [count, 3]
};

// Adds ridge[k] * weight to the diagonals of blocks (K (K + 1) / 2 packed, as AccumulateBlocks
// leaves them) and writes weight = sum of the accumulated weights = block[0] / Y_00^2.
struct AddRidgeParams {
  float* blocks;   // [count, K (K + 1) / 2]
  float* weights;  // [count]
  int64_t count;
  int32_t k;
  float ridge[kMaxShCoeffs];
};

// out[g, k, :] += scale * ridge[k] * weights[g] * x[g, k, :].
struct ApplyRidgeParams {
  const float* weights;  // [count]
  const float* x;        // [count, K, 3]
  float* out;            // [count, K, 3]
  int64_t count;
  int32_t k;
  float scale;
  float ridge[kMaxShCoeffs];
};

// out = a x + b y, element by element; out may be x or y.
struct LinearCombinationParams {
  const float* x;
  const float* y;
  float a, b;
  float* out;
  int64_t count;
};

// A rectangle of an RGB image in 16-bit steps of `unit`, clamped to [0, 65535] of them.
struct PackBoxParams {
  float* image;  // [H, W, 3], read by PackBox, written by UnpackBox
  int32_t width, height;
  int32_t box[4];    // x0, y0, x1, y1, half-open
  uint16_t* packed;  // [y1 - y0, x1 - x0, 3]
  float unit;
};

// out = edited(image) inside `box`.
struct EditImageParams {
  const float* image;   // [H, W, 3]
  const uint8_t* mask;  // [H, W]
  ColorMap map;
  int32_t width, height;
  int32_t box[4];
  float* out;  // [H, W, 3]; may be `image`
};

class StereoOps;  // kernels/stereo.h

// The mask projection's steps (src/selection), so that a view's images never leave backend memory.
// In depth maps, [H, W], 0 is no depth, and rows outside `pixel_rows` (bit 0 is set) are taken to
// be as the wanted one above.

// Depth at continuous pixels (x, y), bilinear in 1/z, exact on planes. 0 outside the image, or
// where the four pixels around lack depth or disagree by more than `max_spread` of the nearest.
struct SampleDepthParams {
  const float* depth;  // [H, W]
  int32_t width, height;
  const double* pixels;  // [count, 2]
  int64_t count;
  double max_spread;  // 0.03
  double* samples;    // [count]
  uint16_t pixel_rows = kAllPixelRows;
};

// 1 / z' = a / z + b, in place; 0 where that is near or below 0. All rows are written.
struct CorrectDepthParams {
  float* depth;  // [H, W]
  int32_t width, height;
  float a, b;
  uint16_t pixel_rows = kAllPixelRows;
};

// Coverage in [0, 1]: the largest of the points that cover a pixel and are not hidden, that is
// further than depth * (1 + depth_tolerance). Each point is a disc in the world across its normal
// (facing the viewer where it has none) of radius `disc_scale` footprints, full within the radius
// less half a footprint and 0 half a footprint outside, its plane's depth tested at every pixel;
// or, where square_pixels > 0, a square of that side about its projection, as deep as the point.
struct DrawCloudParams {
  CameraParams camera;
  const CloudPoint* points;  // [count]
  int64_t count;
  float square_pixels, disc_scale;
  const float* depth;  // [H, W]
  float depth_tolerance;
  float* coverage;  // [H, W], overwritten
};

// mask = 255 clamp(scale * image + offset, 0, 1), rounded; then closed: the maximum over a disc of
// close_radius pixels, then the minimum, inside the image.
struct MakeMaskParams {
  const float* image;  // [H, W]
  int32_t width, height;
  double scale, offset;
  int32_t close_radius;  // 0: not closed
  uint8_t* mask;         // [H, W]
};

// depth = kNoEvidence on the outside of a painted shape's silhouette: where an unpainted pixel has
// a painted one beside it (of eight) that lies nearer by more than `jump` of its depth. Such a
// pixel still sees the fringe of the shape's Gaussians, those behind its limb among them, of which
// the view sees nothing else. Pixels of 128 and more are painted.
struct MarkSilhouetteParams {
  const uint8_t* mask;  // [H, W]
  int32_t width, height;
  float jump;
  float* depth;  // [H, W]
};

// What is known of each pixel: mask value M and weight K. The pixel's surface is looked up in the
// painted views: where one sees it (their depths differ by at most `tolerance`), M is the paint
// there, the mean where several do, and K = 1; else M = 0, K = unknown_weight. `coverage` raises
// both to its value. Where the depth is kNoEvidence, M = K = 0. residual = scale * (K M, K), zero
// outside `pixel_rows`.
struct EvidenceParams {
  CameraParams camera;                    // its pose is not read
  const float* depth;                     // [H, W]; null: none
  std::span<const PaintedImage> painted;  // in host memory, its images in backend memory
  float tolerance, unknown_weight;
  const uint8_t* coverage;  // [H, W], steps of 1 / 255; null: none
  float scale;
  float* residual;  // [H, W, 2]
  uint16_t pixel_rows = kAllPixelRows;
};

// distances[i] = mean distance from point i to the `neighbors` nearest others, [count]. Squares are
// added in x, y, z order and not fused, roots from the nearest on in double precision.
struct NeighborDistancesParams {
  const float* points;  // [count, 3]
  int64_t count;        // more than `neighbors`
  int32_t neighbors;    // 1 to kMaxNeighbors
  float* distances;     // [count]
};

// Arguments that cannot be (channels beyond kMaxChannels, a box outside its image, a region where a
// whole view is needed) are std::invalid_argument. Thread-safe.
class Backend {
 public:
  virtual ~Backend() = default;

  virtual std::string_view Name() const = 0;    // "cpu", "cuda"
  virtual std::string Description() const = 0;  // "AVX-512 (Highway), 2 threads"
  virtual bool Supports(Op op) const = 0;

  // Memory. Zero-initialised. RunError-like std::bad_alloc on exhaustion.
  virtual std::shared_ptr<DeviceMemory> AllocateBytes(size_t bytes) = 0;
  virtual void CopyToDevice(void* device, const void* host, size_t bytes) = 0;
  virtual void CopyToHost(void* host, const void* device, size_t bytes) = 0;
  virtual void Fill(void* device, int byte, size_t bytes) = 0;
  virtual void Synchronize() = 0;
  virtual size_t PeakDeviceBytes() const = 0;  // 0 on the CPU

  template <typename T>
  Buffer<T> Allocate(size_t count) {
    return Buffer<T>(AllocateBytes(count * sizeof(T)), count);
  }
  template <typename T>
  Buffer<T> Upload(std::span<const T> host) {
    auto buffer = Allocate<T>(host.size());
    CopyToDevice(buffer.data(), host.data(), host.size_bytes());
    return buffer;
  }
  template <typename T>
  std::vector<T> Download(const T* device, size_t count) {
    std::vector<T> host(count);
    CopyToHost(host.data(), device, count * sizeof(T));
    return host;
  }

  virtual std::unique_ptr<Model> UploadModel(const GaussianArrays& host) = 0;

  // Projects, culls, sorts and bins: EWA splatting with the constants of common/types.h, exact tile
  // lists.
  virtual std::shared_ptr<const ViewGeometry> PrepareView(const Model& model,
                                                          const CameraParams& camera) = 0;
  // The part of a whole view that active Gaussians touch; `active` is [N] bytes of backend memory.
  // Where `budget_bytes` allows, the region keeps the weights W_A explicitly, which makes Blend and
  // BlendTranspose on it several times cheaper, and equal to the whole view's to some 1e-4 of the
  // features. A region cannot be restricted again.
  virtual std::shared_ptr<const ViewGeometry> Restrict(const ViewGeometry& view,
                                                       const uint8_t* active,
                                                       size_t budget_bytes) = 0;
  // As Restrict, but explicit weights are approximate, in a third of the memory: those below
  // `min_weight` may be left out, where the pixel's others grow so that their sum stays what it
  // was, and the rest are held in 8 bits of each Gaussian's largest in a tile. Tiles left without a
  // weight are no part of the region. Where the budget asks for it, pixel rows are left out as well
  // (see ViewGeometry::pixel_rows), then weights up to 4 min_weight.
  virtual std::shared_ptr<const ViewGeometry> RestrictCompact(const ViewGeometry& view,
                                                              const uint8_t* active,
                                                              size_t budget_bytes,
                                                              float /*min_weight*/) {
    return Restrict(view, active, budget_bytes);
  }

  virtual void Blend(const ViewGeometry& view, const BlendParams& params) = 0;
  virtual void BlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params) = 0;
  virtual void Depth(const ViewGeometry& view, const DepthParams& params) = 0;
  virtual void EvalSh(const Model& model, const EvalShParams& params) = 0;
  virtual void EvalShTranspose(const Model& model, const EvalShTransposeParams& params) = 0;
  virtual ImageLossValue ImageLoss(const ImageLossParams& params) = 0;
  virtual void Adam(const AdamParams& params) = 0;
  virtual void AccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) = 0;
  virtual void FactorBlocks(const FactorBlocksParams& params) = 0;
  virtual void SolveBlocks(const SolveBlocksParams& params) = 0;

  // Steps of the refit; sums do not depend on the number of threads.
  virtual void RegionTarget(const ViewGeometry& region, const RegionTargetParams& params) = 0;
  virtual void RegionResidual(const ViewGeometry& region, const RegionResidualParams& params) = 0;
  // image += delta on the region's tiles, both [H, W, 3].
  virtual void RegionAdd(const ViewGeometry& region, float* image, const float* delta) = 0;
  // The weights of RegionTarget as an image [H, W], 0 outside the region's tiles.
  virtual void RegionWeightImage(const ViewGeometry& region, const uint8_t* weights,
                                 float* image) = 0;
  // sums[g] += {sum_p W[p,g] mask[p] / 255, sum_p W[p,g]} for the Gaussians g of a whole view; mask
  // [H, W], sums [N, 2].
  virtual void AccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums) = 0;
  virtual void ShTangent(const Model& model, const ShTangentParams& params) = 0;
  virtual void AddRidge(const AddRidgeParams& params) = 0;
  virtual void ApplyRidge(const ApplyRidgeParams& params) = 0;
  virtual void LinearCombination(const LinearCombinationParams& params) = 0;
  virtual double Dot(const float* x, const float* y, int64_t count) = 0;
  virtual void PackBox(const PackBoxParams& params) = 0;
  virtual void UnpackBox(const PackBoxParams& params) = 0;
  virtual void EditImage(const EditImageParams& params) = 0;

  // Steps of the mask projection.
  virtual void SampleDepth(const SampleDepthParams& params) = 0;
  virtual void CorrectDepth(const CorrectDepthParams& params) = 0;
  virtual void DrawCloud(const DrawCloudParams& params) = 0;
  virtual void MakeMask(const MakeMaskParams& params) = 0;
  virtual void MarkSilhouette(const MarkSilhouetteParams& params) = 0;
  virtual void Evidence(const EvidenceParams& params) = 0;
  // Between the Gaussians' order, [N, C], and a geometry's rows, [rows, C]: values[r] =
  // of[rows()[r]] and sums[rows()[r]] += values[r].
  virtual void GatherRows(const ViewGeometry& view, const float* of, int32_t channels,
                          float* values) = 0;
  virtual void AddRows(const ViewGeometry& view, const float* values, int32_t channels,
                       float* sums) = 0;

  // Exhaustive, for a device: elsewhere a search tree is the faster one, and it is not supported
  // (std::logic_error).
  virtual void NeighborDistances(const NeighborDistancesParams& params) = 0;

  // Stereo on rendered pairs without leaving backend memory; null where the backend has none. Lives
  // as long as the backend.
  virtual StereoOps* Stereo() { return nullptr; }
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
