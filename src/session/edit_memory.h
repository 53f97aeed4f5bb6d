// SPDX-License-Identifier: BSD-3-Clause
// What an edit takes in memory: estimated before it begins, and checked against what is in use
// before its fit, which takes most.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "recolor/refit_options.h"
#include "session/edit_session.h"

namespace retint {

// What a run may take; 0: as much as there is.
struct MemoryLimits {
  size_t host_bytes = 0;    // 0: three quarters of the machine's memory
  size_t device_bytes = 0;  // on a GPU
  // A cache that was asked for, but at most an eighth of either limit.
  size_t Cache(size_t wanted) const;
  size_t HostBytes() const;
};

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
  bool on_device = false;  // where the coefficients of the fit are then
};

// Of an edit of all that a session holds, but for what is fitted and completed.
EditSize SizeOfWhole(const EditSession& session);

// About what it takes at its peak, beside the caches and what is in memory before; what is behind
// the figures is in docs/scale.md, what was measured in docs/benchmarks.md.
size_t HostBytesOf(const EditSize& size);
size_t DeviceBytesOf(const EditSize& size);

// The caches that a run can have in what is left of its limits beside `bytes`: of each what was
// asked for, at most an eighth of the limit, and at most a third of what is left.
size_t CacheBeside(const MemoryLimits& limits, size_t host_bytes, size_t device_bytes,
                   size_t wanted);

// In memory now, of the process.
size_t ResidentBytes();

// How much of its weights and targets the fit of a session's region can keep, beside all that is in
// memory now and what the fit and the report on it will take: at most
// size.refit.region_cache_bytes, the same on all ranks. What is not kept is made anew in each
// sweep. size.active is not used but counted. OptionError, one line that says what would do, where
// it does not fit even so.
size_t RegionCacheThatFits(const MemoryLimits& limits, EditSession& session, RegionId region,
                           EditSize size);

}  // namespace retint
