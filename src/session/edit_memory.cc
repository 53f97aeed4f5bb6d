// SPDX-License-Identifier: BSD-3-Clause
#include "session/edit_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "base/error.h"
#include "base/memory.h"
#include "base/ranks.h"

namespace retint {
namespace {

constexpr size_t kMiB = size_t{1} << 20;
// Of the program's code, threads and what the allocator keeps between blocks.
constexpr size_t kProgramBytes = 64 * kMiB;
constexpr double kFragments = 1.08;  // of all that is taken, over what was asked for
// A Gaussian of degree 3 in the model and on the CPU backend, with its number and flags.
constexpr size_t kGaussian = 2 * 236 + 60;
constexpr size_t kCoefficients = 192;  // one copy of them
// Copies for the report and the output, beside the model's: after the edit, and on the backend.
constexpr size_t kCopies = 2;
constexpr size_t kDeviceGaussian = 750;
// Of the largest view: images, and the volumes in which stereo adds up its costs, five bytes a
// disparity (kernels/cuda/stereo_match.cu), of 128 disparities.
constexpr size_t kDevicePixel = 110 + 5 * 128;
constexpr size_t kCopiesBesideDevice = 4;  // of a fit's coefficients: before, start and after
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
  const bool lbfgs = options.mm.acceleration == MmAcceleration::kLbfgs;
  return kBlock + (lbfgs ? 12 + 2 * kPairs : 10) * kCoefficients;
}

size_t Of(uint64_t count, size_t bytes) { return static_cast<size_t>(count) * bytes; }

// The surfaces that a projection holds at a time.
size_t SurfaceBytes(const EditSize& size) {
  const size_t surface = Of(size.most_visible, kBatchVisible) + size.largest_pixels * kBatchPixel;
  return std::min(kBatchBytes + surface, std::min(size.views, kBatchViews) * surface);
}

// What a stage takes for a while: the one that takes most, and the view that it works on.
size_t WorkBytes(const EditSize& size, size_t projection) {
  const size_t of_active =
      size.on_device ? kCopiesBesideDevice * kCoefficients : FitBytes(size.refit);
  const size_t fit = Of(size.active, of_active);
  const size_t report = size.active > 0 ? Of(size.gaussians, kCopies * kCoefficients) : 0;
  return Of(size.most_visible, kVisible) + size.largest_pixels * kPixel +
         std::max({projection, fit, report});
}

[[noreturn]] void FailFit(const char* flag, size_t limit, size_t taken, size_t active) {
  const size_t would_do = taken / 3 * 4;  // caches grow with the limit
  throw OptionError(std::string(flag) + " " + std::to_string(limit / kMiB) +
                    " is too little for the fit of " + std::to_string(active) + " Gaussians; " +
                    flag + " " + std::to_string(would_do / kMiB + 1) +
                    " does, or a smaller selection");
}

}  // namespace

size_t MemoryLimits::HostBytes() const {
  if (host_bytes > 0) return host_bytes;
  const auto pages = static_cast<size_t>(sysconf(_SC_PHYS_PAGES));
  return pages * static_cast<size_t>(sysconf(_SC_PAGE_SIZE)) / 4 * 3;
}

size_t MemoryLimits::Cache(size_t wanted) const {
  if (host_bytes > 0) wanted = std::min(wanted, host_bytes / 8);
  if (device_bytes > 0) wanted = std::min(wanted, device_bytes / 8);
  return wanted;
}

EditSize SizeOfWhole(const EditSession& session) {
  EditSize size;
  size.gaussians = size.most_visible = session.original().NumGaussians();
  size.on_device = !session.scene().backend().IsHost();
  for (const View* view : session.scene().views()) {
    const Camera& camera = session.reconstruction().Posed(*view).camera;
    const auto pixels = static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
    size.pixels += pixels;
    size.largest_pixels = std::max(size.largest_pixels, pixels);
    ++size.views;
  }
  return size;
}

size_t HostBytesOf(const EditSize& size) {
  const size_t projection = Of(size.graph_nodes, kGraphNodeMaking) + SurfaceBytes(size);
  const size_t held =
      Of(size.gaussians, kGaussian) + Of(size.graph_nodes, kGraphNode) + size.pixels * kMaskPixel;
  const size_t bytes = held + WorkBytes(size, projection);
  return kProgramBytes + static_cast<size_t>(kFragments * static_cast<double>(bytes));
}

size_t DeviceBytesOf(const EditSize& size) {
  return Of(size.gaussians, kDeviceGaussian) + size.largest_pixels * kDevicePixel +
         std::max(SurfaceBytes(size), Of(size.active, FitBytes(size.refit)));
}

size_t CacheBeside(const MemoryLimits& limits, size_t host_bytes, size_t device_bytes,
                   size_t wanted) {
  constexpr size_t kParts = 3;
  const auto room = [](size_t limit, size_t taken) { return limit > taken ? limit - taken : 0; };
  wanted = std::min(limits.Cache(wanted), room(limits.HostBytes(), host_bytes) / kParts);
  if (limits.device_bytes == 0) return wanted;
  return std::min(wanted, room(limits.device_bytes, device_bytes) / kParts);
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
  for (const float share : session.regions().Find(region)->selection->shares) {
    size.active += static_cast<double>(share) > size.refit.active_threshold;
  }
  size_t room = size.refit.region_cache_bytes;
  const auto fit_into = [&](const char* flag, size_t limit, size_t taken, bool is_kept_there) {
    if (taken > limit) FailFit(flag, limit, taken, size.active);
    if (is_kept_there) room = std::min(room, limit - taken);
  };
  ReleaseFreedMemory();
  const bool on_host = session.scene().backend().IsHost();
  const size_t cache = session.options().cache_bytes;  // of geometries, when it is full
  const size_t cached = on_host ? session.renderer().cached_bytes() : 0;
  const size_t work = static_cast<size_t>(kFragments * static_cast<double>(WorkBytes(size, 0)));
  fit_into("--memory-mb", limits.HostBytes(),
           ResidentBytes() - cached + (on_host ? cache : 0) + work, on_host);
  if (limits.device_bytes > 0 && !on_host) {
    fit_into("--device-memory-mb", limits.device_bytes, DeviceBytesOf(size) + cache,
             /*is_kept_there=*/true);
  }
  const uint64_t own = room;
  for (const uint64_t one : CurrentRanks().Gather<uint64_t>(std::span(&own, 1))) {
    room = std::min<size_t>(room, one);
  }
  return room;
}

}  // namespace retint
