// SPDX-License-Identifier: BSD-3-Clause
// The region for panels, tools and shortcuts. If it is deleted, its neighbor replaces it; if it
// comes back, it is current again.
#pragma once

#include <vector>

#include <QObject>

#include "viewer/scene/scene_controller.h"

namespace retint {

class CurrentRegion : public QObject {
  Q_OBJECT

 public:
  explicit CurrentRegion(SceneController* controller, QObject* parent = nullptr);

  RegionId id() const { return id_; }  // 0: none
  const Region* region() const;        // null: none
  // A region that does not exist counts as none.
  void Set(RegionId id);

 Q_SIGNALS:
  void changed(retint::RegionId id);

 private:
  void Follow();

  SceneController* controller_;
  RegionId id_ = 0;
  std::vector<RegionId> known_;  // regions before the newest change, in order
};

}  // namespace retint
