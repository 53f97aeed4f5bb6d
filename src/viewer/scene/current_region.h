// SPDX-License-Identifier: BSD-3-Clause
// The region that panels, tools and shortcuts mean. One that comes back takes its place again, and
// when it is deleted its neighbor does.
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
  // One that there is not counts as none.
  void Set(RegionId id);

 Q_SIGNALS:
  void changed(retint::RegionId id);

 private:
  void Follow();

  SceneController* controller_;
  RegionId id_ = 0;
  std::vector<RegionId> known_;  // the regions before the newest change, in their order
};

}  // namespace retint
