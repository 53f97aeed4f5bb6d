// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/edit_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/memory.h"
#include "base/option_name.h"
#include "base/ranks.h"

namespace retint {
namespace {

constexpr size_t kMiB = size_t{1} << 20;
// Of the program's code, threads and the allocator's free space between blocks.
constexpr size_t kProgramBytes = 64 * kMiB;
constexpr double kFragments = 1.08;  // of all that is taken, over the requested sizes
constexpr size_t kModel = 236;       // a Gaussian of degree 3 in the model or on the CPU backend
constexpr size_t kNumberAndFlags = 60;
constexpr size_t kCoefficients = 192;  // one copy of them
// Copies for the report and the output, beside the model's.
constexpr size_t kCopies = 2;
// Beside a device: page-locked buffers of large copies (kernels/cuda/staged_copy.cuh), and as much
// for the code that the driver loads when a kernel first runs.
constexpr size_t kBesideDevice = 128 * kMiB;
// On the device: the model, and the memory of preparing a view or of the report for that time.
constexpr size_t kDeviceGaussian = 750;
// The volumes in which stereo adds up its costs, five bytes a disparity
// (kernels/cuda/stereo_match.cu), of 128 disparities.
constexpr size_t kStereoPixel = 5 * 128;
// Of the graph that is solved: at most 32 edges of 8 bytes, and the vectors
// (kernels/cuda/graph.cu).
constexpr size_t kDeviceGraphNode = 32 * 8 + 72;
constexpr size_t kCopiesBesideDevice = 4;   // of a fit's coefficients: before, start and after
constexpr size_t kVisibleBesideDevice = 8;  // of a view's rows, which Gaussian each is
// Of a view, a Gaussian that it sees: while it is projected and sorted, and restricted to those
// that are fitted.
constexpr size_t kVisible = 400;
// Of the graph of a completion, which is kept, and more of it while it is made and solved
// (selection/gaussian_graph.h).
constexpr size_t kGraphNode = 450, kGraphNodeMaking = 550;
constexpr size_t kPixel = 110;  // of the view that is worked on: images, residuals, targets
constexpr size_t kMaskPixel = 2;
// Views whose surfaces are held at a time, at most (selection/view_depth.h).
constexpr size_t kBatchBytes = 256 * kMiB, kBatchViews = 32;
constexpr size_t kBatchVisible = 130, kBatchPixel = 5;

// Of a Gaussian of degree 3 that is fitted.
size_t FitBytes(const RefitOptions& options) {
  constexpr size_t kBlock = 4 * 136;  // a symmetric 16 x 16
  if (options.solver == Solver::kAdam) return 8 * kCoefficients;
  // The pairs of L-BFGS, two copies each (recolor/mm_solver.h).
  constexpr size_t kPairs = 6;
  return kBlock + (11 + 2 * kPairs) * kCoefficients;
}

size_t Of(uint64_t count, size_t bytes) { return static_cast<size_t>(count) * bytes; }

// The surfaces that a projection holds at a time.
size_t SurfaceBytes(const EditSize& size) {
  const size_t surface = Of(size.most_visible, kBatchVisible) + size.largest_pixels * kBatchPixel;
  return std::min(kBatchBytes + surface, std::min(size.views, kBatchViews) * surface);
}

// Host memory that a stage takes for a while: of the largest stage and its current view.
size_t WorkBytes(const EditSize& size, size_t projection) {
  const size_t of_active =
      size.on_device ? kCopiesBesideDevice * kCoefficients : FitBytes(size.refit);
  const size_t fit = Of(size.active, of_active);
  // On the CPU, the current view takes more than the copy of a model.
  const size_t model = size.is_whole && size.on_device ? kModel : 0;
  const size_t report = size.active > 0 ? Of(size.gaussians, kCopies * kCoefficients + model) : 0;
  return Of(size.most_visible, size.on_device ? kVisibleBesideDevice : kVisible) +
         size.largest_pixels * kPixel + std::max({projection, fit, report});
}

// Bytes on a device; `before` is the need of the stages before the fit.
size_t OnDevice(const EditSize& size, size_t before) {
  return Of(size.gaussians, kDeviceGaussian) + size.largest_pixels * kPixel +
         std::max(before, Of(size.active, FitBytes(size.refit)));
}

size_t WithFragments(size_t bytes) {
  return static_cast<size_t>(kFragments * static_cast<double>(bytes));
}

// The largest request within a limit.
size_t WithoutFragments(size_t bytes) {
  return static_cast<size_t>(static_cast<double>(bytes) / kFragments);
}

std::string Mebibytes(size_t bytes) { return std::to_string((bytes + kMiB - 1) / kMiB); }

// "a is", "a and b are".
std::string Joined(const std::vector<std::string>& one_or_two) {
  return one_or_two.size() == 1 ? one_or_two[0] + " is"
                                : one_or_two[0] + " and " + one_or_two[1] + " are";
}

// Caches grow with a limit: a sufficient limit has room for that.
[[noreturn]] void FailFit(const MemoryLimits& limits, const MemoryBytes& taken, size_t on_cpu,
                          size_t active) {
  const auto with_caches = [](size_t bytes) { return bytes / 3 * 4 + kMiB; };
  MemoryBytes enough = taken;
  if (taken.host > limits.HostBytes()) enough.host = with_caches(taken.host);
  if (taken.device > limits.DeviceBytes()) enough.device = with_caches(taken.device);
  throw OptionError(TooLittle(limits, taken) + " for the fit of " + std::to_string(active) +
                    " Gaussians; " + Enough(limits, enough, with_caches(on_cpu)) +
                    ", or a smaller selection");
}

}  // namespace

MemoryLimits MemoryLimits::For(const Device& backend) const {
  MemoryLimits limits = *this;
  limits.device_has = backend.AvailableDeviceBytes();
  return limits;
}

size_t MemoryLimits::HostBytes() const {
  if (host_bytes > 0) return host_bytes;
  const auto pages = static_cast<size_t>(sysconf(_SC_PHYS_PAGES));
  return pages * static_cast<size_t>(sysconf(_SC_PAGE_SIZE)) / 4 * 3;
}

size_t MemoryLimits::DeviceBytes() const {
  if (device_has == 0) return 0;
  return device_bytes > 0 ? device_bytes : device_has / 10 * 9;
}

size_t MemoryLimits::On(MemorySide side) const {
  return side == MemorySide::kHost ? HostBytes() : DeviceBytes();
}

bool MemoryLimits::Hold(const MemoryBytes& bytes) const {
  return bytes.host <= HostBytes() && bytes.device <= DeviceBytes();
}

size_t MemoryLimits::Cache(MemorySide side, size_t wanted) const {
  const size_t given = side == MemorySide::kHost ? host_bytes : device_bytes;
  return given > 0 ? std::min(wanted, given / 8) : wanted;
}

std::string TooLittle(const MemoryLimits& limits, const MemoryBytes& bytes) {
  std::vector<std::string> exceeded;
  if (bytes.host > limits.HostBytes()) {
    exceeded.push_back(OptionName("memory_mb", std::to_string(limits.HostBytes() / kMiB)));
  }
  if (bytes.device > limits.DeviceBytes()) {
    const std::string by_default = limits.device_bytes > 0 ? "" : "the default ";
    exceeded.push_back(by_default +
                       OptionName("device_memory_mb", std::to_string(limits.DeviceBytes() / kMiB)));
  }
  return Joined(exceeded) + " too little";
}

std::string Enough(const MemoryLimits& limits, const MemoryBytes& bytes, size_t on_cpu) {
  std::vector<std::string> needed;
  if (bytes.host > limits.HostBytes())
    needed.push_back(OptionName("memory_mb", Mebibytes(bytes.host)));
  std::string otherwise;
  if (bytes.device > limits.DeviceBytes()) {
    const bool is_there = bytes.device <= limits.device_has;
    needed.push_back(is_there
                         ? OptionName("device_memory_mb", Mebibytes(bytes.device))
                         : "a GPU with " + Mebibytes(bytes.device / 9 * 10 + 10) + " MiB free");
    if (!is_there)
      otherwise =
          ", or " + OptionName("backend", "cpu") + " " + OptionName("memory_mb", Mebibytes(on_cpu));
  }
  return Joined(needed) + " enough" + otherwise;
}

EditSize SizeOfWhole(const EditSession& session) {
  EditSize size;
  size.gaussians = size.most_visible = session.scene().original().NumGaussians();
  size.on_device = !session.scene().backend().IsHost();
  size.is_whole = true;
  for (const View* view : session.scene().views()) {
    const Camera& camera = session.scene().reconstruction().Posed(*view).camera;
    const auto pixels = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
    size.pixels += pixels;
    size.largest_pixels = std::max(size.largest_pixels, pixels);
    ++size.views;
  }
  return size;
}

size_t HostBytesOf(const EditSize& size) {
  const size_t surfaces = size.on_device ? 0 : SurfaceBytes(size);
  const size_t projection = Of(size.graph_nodes, kGraphNodeMaking) + surfaces;
  const size_t models = (size.on_device ? 1 : 2) * kModel;
  const size_t held = Of(size.gaussians, models + kNumberAndFlags) +
                      Of(size.graph_nodes, kGraphNode) + size.pixels * kMaskPixel;
  return kProgramBytes + (size.on_device ? kBesideDevice : 0) +
         WithFragments(held + WorkBytes(size, projection));
}

size_t DeviceBytesOf(const EditSize& size) {
  if (!size.on_device) return 0;
  return OnDevice(size, std::max({size.largest_pixels * kStereoPixel, SurfaceBytes(size),
                                  Of(size.graph_nodes, kDeviceGraphNode)}));
}

MemoryBytes FitBytesOf(const EditSize& size) {
  return {WithFragments(WorkBytes(size, 0)), size.on_device ? OnDevice(size, 0) : 0};
}

size_t CacheBeside(const MemoryLimits& limits, MemorySide side, size_t taken, size_t wanted) {
  constexpr size_t kParts = 3;
  const size_t limit = limits.On(side);
  return std::min(limits.Cache(side, wanted), (limit > taken ? limit - taken : 0) / kParts);
}

size_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  size_t all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<size_t>(sysconf(_SC_PAGE_SIZE));
}

size_t RegionCacheThatFits(const MemoryLimits& limits, EditSession& session, RegionId region,
                           EditSize size) {
  size.active = 0;
  for (const float share : session.store().regions().Find(region)->selection->shares) {
    size.active += static_cast<double>(share) > size.refit.active_threshold;
  }
  ReleaseFreedMemory();
  const size_t resident = ResidentBytes();
  const MemorySide side = limits.CacheSide();
  const size_t cache = session.scene().options().cache_bytes;  // of geometries, when it is full
  MemoryBytes taken = FitBytesOf(size);
  taken.host += resident - (size.on_device ? 0 : session.scene().renderer().cached_bytes());
  taken.On(side) += cache;
  // Estimates are up to 1.7 times the memory used. The default of a device keeps the caches small,
  // and refuses nothing that may fit.
  const bool holds = taken.host <= limits.HostBytes() &&
                     (limits.device_bytes == 0 || taken.device <= limits.DeviceBytes());
  if (!holds) {
    EditSize on_cpu = size;
    on_cpu.on_device = false;
    FailFit(limits, taken, resident + HostBytesOf(on_cpu) + cache, size.active);
  }
  const size_t limit = limits.On(side);
  size_t left = limit - std::min(limit, taken.On(side));
  if (side == MemorySide::kHost) left = WithoutFragments(left);
  size_t room = std::min(size.refit.RegionCacheBytes(), left);
  const uint64_t own = room;
  for (const uint64_t one : CurrentRanks().Gather<uint64_t>(std::span(&own, 1))) {
    room = std::min<size_t>(room, one);
  }
  return room;
}

}  // namespace retint
