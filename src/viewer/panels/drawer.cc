// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/drawer.h"

#include <QSettings>

namespace retint {

Drawer::Drawer(const QString& name, const QString& title, QWidget* content) {
  setObjectName(name);
  setText(title);
  setToolTip(tr("Show or hide what few people need"));
  setCheckable(true);
  setAutoRaise(true);
  setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  setFocusPolicy(Qt::StrongFocus);
  const bool open = QSettings().value(name, false).toBool();
  setChecked(open);
  setArrowType(open ? Qt::DownArrow : Qt::RightArrow);
  if (!open) content->hide();  // a shown widget without a parent would be a window
  connect(this, &QToolButton::toggled, content, [=, this](bool on) {
    QSettings().setValue(name, on);
    setArrowType(on ? Qt::DownArrow : Qt::RightArrow);
    content->setVisible(on);
  });
}

}  // namespace retint
