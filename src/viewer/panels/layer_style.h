// SPDX-License-Identifier: BSD-3-Clause
// Check boxes in a list of layers: an eye in the first column, an S in others.
#pragma once

#include <QProxyStyle>

namespace retint {

// The height of a row in pixels, even if the list is empty.
int LayerHeight(const QWidget& list);

class LayerStyle : public QProxyStyle {
 public:
  explicit LayerStyle(QObject* parent);
  void drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override;
};

}  // namespace retint
