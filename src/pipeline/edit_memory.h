// SPDX-License-Identifier: BSD-3-Clause
// The memory of an edit: estimated before it begins, and checked against the memory in use before
// its fit, which takes most.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "editing/edit_session.h"
#include "recolor/refit_options.h"

namespace retint {

// Whose memory it is. The backend decides on which side its caches (geometries, weights and targets
// of a fit) are; photos are always the host's.
enum class MemorySide { kHost, kDevice };

struct MemoryBytes {
  size_t host = 0, device = 0;
  size_t& On(MemorySide side) { return side == MemorySide::kHost ? host : device; }
  size_t On(MemorySide side) const { return side == MemorySide::kHost ? host : device; }
};

// The memory that a run may take.
struct MemoryLimits {
  size_t host_bytes = 0;    // 0: three quarters of the machine's memory
  size_t device_bytes = 0;  // of a GPU; 0: nine tenths of `device_has`
  size_t device_has = 0;    // Device::AvailableDeviceBytes() of the run's backend; 0: it has no GPU

  // The same for a run with this backend.
  MemoryLimits For(const Device& backend) const;
  MemorySide CacheSide() const { return device_has > 0 ? MemorySide::kDevice : MemorySide::kHost; }
  size_t HostBytes() const;
  size_t DeviceBytes() const;  // 0 without a GPU
  size_t On(MemorySide side) const;
  bool Hold(const MemoryBytes& bytes) const;
  // A cache of the backend that was asked for, but at most an eighth of the limit where it lies, if
  // one was given.
  size_t Cache(size_t wanted) const { return Cache(CacheSide(), wanted); }
  size_t Cache(MemorySide side, size_t wanted) const;
};

// The two halves of a refusal: the limits that `bytes` exceed, as in "`memory_mb=50` is too
// little", and the remedy, as in "`memory_mb=96` is enough". The remedy is a limit. If the GPU has
// less memory, it is also the CPU backend with `on_cpu` bytes.
std::string TooLittle(const MemoryLimits& limits, const MemoryBytes& bytes);
std::string Enough(const MemoryLimits& limits, const MemoryBytes& bytes, size_t on_cpu);

// How large an edit is.
struct EditSize {
  uint64_t gaussians = 0;     // that are opened
  uint64_t most_visible = 0;  // of them, that a single view may see
  uint64_t active = 0;        // of them, that are fitted, about; 0: there is no fit
  uint64_t graph_nodes = 0;   // of them, among which a selection is completed
  size_t views = 0;
  size_t pixels = 0;          // of all views, whose masks are held
  size_t largest_pixels = 0;  // of the largest view
  RefitOptions refit = {};
  bool on_device = false;  // on a GPU, which then has all that the kernels work on
  bool is_whole = false;   // the whole splat, of which a copy is written
};

// Of an edit of all that a session holds, without its fit and completion.
EditSize SizeOfWhole(const EditSession& session);

// About the edit's memory at its peak, without the caches and the memory in use before.
// docs/scale.md explains the figures, docs/benchmarks.md has measured ones.
size_t HostBytesOf(const EditSize& size);
size_t DeviceBytesOf(const EditSize& size);  // 0 on the CPU
// Of it, the part that the fit and its report add on the host to the opened scene; and the part on
// the device from the fit on.
MemoryBytes FitBytesOf(const EditSize& size);

// The cache that a run can have on that side of the memory. It is `wanted`, at most
// MemoryLimits::Cache(), and at most a third of the rest of the limit beside `taken`.
size_t CacheBeside(const MemoryLimits& limits, MemorySide side, size_t taken, size_t wanted);

// In memory now, of the process.
size_t ResidentBytes();

// How much of its weights and targets the fit of a session's region can keep, the same on all
// ranks. It is at most size.refit.region_cache_mb, and leaves room for the memory in use and the
// needs of the fit and its report. The rest is recomputed in each sweep. size.active is ignored;
// the active Gaussians are counted. OptionError, one line with a limit that is enough, if not even
// the fit without a cache has room.
size_t RegionCacheThatFits(const MemoryLimits& limits, EditSession& session, RegionId region,
                           EditSize size);

}  // namespace retint
