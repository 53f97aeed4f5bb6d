// SPDX-License-Identifier: BSD-3-Clause
// How a list of layers draws its check boxes: an eye in the first column, an S in others.
#pragma once

#include <QProxyStyle>

namespace retint {

// Of a row, pixels; also while there is none.
int LayerHeight(const QWidget& list);

class LayerStyle : public QProxyStyle {
 public:
  explicit LayerStyle(QObject* parent);
  void drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override;
};

}  // namespace retint
