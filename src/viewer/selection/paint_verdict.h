// SPDX-License-Identifier: BSD-3-Clause
// What became of the paint, after every selection: a line in words, in the banner over the canvas,
// and a picture of each painted view, small there and large on a click.
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

  // Of a region whose selection was just made. It goes when the region is edited or selected anew.
  void Show(RegionId id);

 Q_SIGNALS:
  void paintWanted(retint::RegionId id);  // much of the paint is left out, and the user paints on

 private:
  struct Pictures;
  void Say(const std::shared_ptr<const Pictures>& pictures);
  void Open(const Pictures& pictures);
  void Look();  // whether the verdict is still of what shows

  SceneController* controller_;
  Banner* banner_;
  QWidget* window_;
  RegionId region_ = 0;                               // 0: no verdict shows
  std::shared_ptr<const RegionSelection> selection_;  // which it is about
  bool was_plain_ = false;                            // the region's edit changed nothing then
  bool warns_ = false;
  QString text_;
};

}  // namespace retint
