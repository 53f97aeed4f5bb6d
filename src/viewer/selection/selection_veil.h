// SPDX-License-Identifier: BSD-3-Clause
// A preview of the selection, as a mask of the painted view. It lies over the view beside the paint
// (ComposeVeil) until the user accepts.
#pragma once

#include <QObject>
#include <QVariantAnimation>

#include "scene/image.h"
#include "viewer/selection/mask_editor.h"

namespace retint {

class SelectionVeil : public QObject {
  Q_OBJECT

 public:
  explicit SelectionVeil(QObject* parent = nullptr);

  const Mask& mask() const { return mask_; }  // empty: nothing is shown
  double opacity() const;                     // below 1 while it fades
  void Show(Mask mask);
  void Fade();   // disappears in a moment
  void Clear();  // at once

 Q_SIGNALS:
  void changed(const retint::GridRect& part);  // pixels that look different now; may be empty

 private:
  Mask mask_;
  GridRect inside_;  // bounds of its inside
  QVariantAnimation fade_;
};

}  // namespace retint
