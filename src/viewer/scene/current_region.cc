// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/current_region.h"

#include <algorithm>
#include <utility>

namespace retint {

CurrentRegion::CurrentRegion(SceneController* controller, QObject* parent)
    : QObject(parent), controller_(controller) {
  connect(controller_, &SceneController::opened, this, [this] { known_.clear(); });
  connect(controller_, &SceneController::regionsChanged, this, &CurrentRegion::Follow);
}

const Region* CurrentRegion::region() const { return controller_->regions().Find(id_); }

void CurrentRegion::Set(RegionId id) {
  if (id != 0 && !controller_->regions().Find(id)) id = 0;
  if (id == id_) return;
  id_ = id;
  Q_EMIT changed(id);
}

void CurrentRegion::Follow() {
  const std::vector<Region>& regions = controller_->regions().regions;
  std::vector<RegionId> now, added;
  for (const Region& region : regions) {
    now.push_back(region.id);
    if (std::ranges::find(known_, region.id) == known_.end()) added.push_back(region.id);
  }
  const auto before = std::exchange(known_, now);
  if (added.size() == 1) return Set(added.front());
  if (region()) return;
  const auto place = std::ranges::find(before, id_) - before.begin();
  const auto next = std::min<std::ptrdiff_t>(place, std::ssize(now) - 1);
  const bool deleted = place < std::ssize(before);
  Set(deleted && next >= 0 ? now[size_t(next)] : 0);
}

}  // namespace retint
