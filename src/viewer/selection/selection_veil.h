// SPDX-License-Identifier: BSD-3-Clause
// What paint selects by a look ahead, as a mask of the view that is painted: laid over it beside
// the paint (ComposeVeil), as long as that is not accepted.
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

  const Mask& mask() const { return mask_; }  // no pixels: nothing shows
  double opacity() const;                     // below 1 while it fades
  void Show(Mask mask);
  void Fade();   // away, in a moment
  void Clear();  // at once

 Q_SIGNALS:
  void changed(const retint::GridRect& part);  // that looks different now; may be empty

 private:
  Mask mask_;
  GridRect inside_;  // holds its inside part
  QVariantAnimation fade_;
};

}  // namespace retint
