// SPDX-License-Identifier: BSD-3-Clause
// The geometries of recent views, within a budget of memory; the least recently used one is removed
// first. If their backends work in host memory, renderers of the same Gaussians may share a cache,
// each on its own thread. This is possible because a geometry does not change once it is made, and
// has no colors.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "kernels/blend_ops.h"

namespace retint {

// Any thread may call it.
class GeometryCache {
 public:
  explicit GeometryCache(size_t budget_bytes) : budget_(budget_bytes) {}

  // Null: it is not here.
  std::shared_ptr<const ViewGeometry> Find(const CameraParams& view);
  bool Contains(const CameraParams& view) const;
  // Replaces the geometry that is there for that view. A geometry that alone exceeds the budget is
  // not kept: it would push out everything else.
  void Insert(std::shared_ptr<const ViewGeometry> geometry);
  // False: there was nothing.
  bool Clear();
  size_t bytes() const;

  // As long as it lives, a part of the budget is for something else: the requested bytes, but an
  // eighth is left for geometries in any case.
  class Reservation {
   public:
    explicit Reservation(std::shared_ptr<GeometryCache> cache);
    ~Reservation();
    void Set(size_t bytes);
    Reservation(const Reservation&) = delete;
    Reservation& operator=(const Reservation&) = delete;

   private:
    std::shared_ptr<GeometryCache> cache_;
    size_t bytes_ = 0;
  };

 private:
  // CameraParams has no padding (its size is asserted where it is declared), so its bytes are its
  // identity.
  struct SameBytes {
    bool operator()(const CameraParams& a, const CameraParams& b) const;
  };
  struct HashBytes {
    size_t operator()(const CameraParams& params) const;
  };
  struct Entry {
    std::shared_ptr<const ViewGeometry> geometry;
    size_t bytes;
  };

  void Erase(std::list<Entry>::iterator entry);
  // The part of the budget for geometries.
  size_t Room() const;
  void ShrinkTo(size_t bytes);

  const size_t budget_;
  mutable std::mutex mutex_;
  // Guarded by mutex_.
  std::list<Entry> entries_;  // most recently used first
  std::unordered_map<CameraParams, std::list<Entry>::iterator, HashBytes, SameBytes> index_;
  size_t bytes_ = 0, reserved_ = 0;
};

}  // namespace retint
