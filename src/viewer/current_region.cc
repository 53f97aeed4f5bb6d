// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/current_region.h"

namespace retint {

CurrentRegion::CurrentRegion(SceneController* controller, QObject* parent)
    : QObject(parent), controller_(controller) {}

const Region* CurrentRegion::region() const { return controller_->regions().Find(id_); }

void CurrentRegion::Set(RegionId id) {
  if (id != 0 && !controller_->regions().Find(id)) id = 0;
  if (id == id_) return;
  id_ = id;
  Q_EMIT changed(id);
}

}  // namespace retint
