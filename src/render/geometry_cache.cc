// SPDX-License-Identifier: BSD-3-Clause
#include "render/geometry_cache.h"

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <string_view>
#include <utility>

namespace retint {

bool GeometryCache::SameBytes::operator()(const CameraParams& a, const CameraParams& b) const {
  return std::memcmp(&a, &b, sizeof(CameraParams)) == 0;
}

size_t GeometryCache::HashBytes::operator()(const CameraParams& params) const {
  return std::hash<std::string_view>{}(
      {reinterpret_cast<const char*>(&params), sizeof(CameraParams)});
}

std::shared_ptr<const ViewGeometry> GeometryCache::Find(const CameraParams& view) {
  const std::lock_guard lock(mutex_);
  const auto found = index_.find(view);
  if (found == index_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, found->second);
  return found->second->geometry;
}

bool GeometryCache::Contains(const CameraParams& view) const {
  const std::lock_guard lock(mutex_);
  return index_.contains(view);
}

void GeometryCache::Insert(std::shared_ptr<const ViewGeometry> geometry) {
  const std::lock_guard lock(mutex_);
  const CameraParams& view = geometry->camera();
  if (const auto found = index_.find(view); found != index_.end()) Erase(found->second);
  const size_t size = geometry->bytes(), room = Room();
  if (size > room) return;
  ShrinkTo(room - size);
  entries_.push_front({geometry, size});
  index_.emplace(view, entries_.begin());
  bytes_ += size;
}

bool GeometryCache::Clear() {
  const std::lock_guard lock(mutex_);
  const bool any = !entries_.empty();
  ShrinkTo(0);
  return any;
}

size_t GeometryCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

void GeometryCache::Erase(std::list<Entry>::iterator entry) {
  bytes_ -= entry->bytes;
  index_.erase(entry->geometry->camera());
  entries_.erase(entry);
}

size_t GeometryCache::Room() const { return budget_ - std::min(reserved_, budget_ / 8 * 7); }

void GeometryCache::ShrinkTo(size_t bytes) {
  while (bytes_ > bytes) Erase(std::prev(entries_.end()));
}

GeometryCache::Reservation::Reservation(std::shared_ptr<GeometryCache> cache)
    : cache_(std::move(cache)) {}

GeometryCache::Reservation::~Reservation() { Set(0); }

void GeometryCache::Reservation::Set(size_t bytes) {
  const std::lock_guard lock(cache_->mutex_);
  cache_->reserved_ += bytes - bytes_;
  bytes_ = bytes;
  cache_->ShrinkTo(cache_->Room());
}

}  // namespace retint
