// SPDX-License-Identifier: BSD-3-Clause
// A line with an arrow that shows and hides the content below.
#pragma once

#include <QToolButton>

namespace retint {

// Closed at first. The settings remember it under `name`, which is also the button's name. Put the
// drawer and `content` into a layout, one below the other.
class Drawer : public QToolButton {
 public:
  Drawer(const QString& name, const QString& title, QWidget* content);
};

}  // namespace retint
