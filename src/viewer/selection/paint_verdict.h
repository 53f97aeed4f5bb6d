// SPDX-License-Identifier: BSD-3-Clause
// The effect of the paint, after every selection: a line of text in the banner over the canvas, and
// a picture of each painted view, which a click enlarges.
#pragma once

#include <memory>

#include <QObject>
#include <QString>

#include "editing/region.h"

class QWidget;

namespace retint {

class Banner;
class SceneController;

class PaintVerdict : public QObject {
  Q_OBJECT

 public:
  // `window` is the parent of the large pictures.
  PaintVerdict(SceneController* controller, Banner* banner, QWidget* window);

  // For a region that was just selected. It closes when the region is edited or selected again.
  void Show(RegionId id);

 Q_SIGNALS:
  void paintWanted(retint::RegionId id);  // much of the paint is left out, and the user paints on

 private:
  struct Pictures;
  void Say(const std::shared_ptr<const Pictures>& pictures);
  void Open(const Pictures& pictures);
  void Look();  // closes the verdict if it is out of date

  SceneController* controller_;
  Banner* banner_;
  QWidget* window_;
  RegionId region_ = 0;                               // 0: no verdict shows
  std::shared_ptr<const RegionSelection> selection_;  // selection that it describes
  bool was_plain_ = false;                            // the region's edit had no effect then
  bool warns_ = false;
  QString text_;
};

}  // namespace retint
