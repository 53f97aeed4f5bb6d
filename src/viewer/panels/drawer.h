// SPDX-License-Identifier: BSD-3-Clause
// A line with an arrow that shows and hides what lies below it.
#pragma once

#include <QToolButton>

namespace retint {

// Closed at first; the settings remember it by `name`, which also names the button. Put both the
// drawer and `content` into a layout, one below the other.
class Drawer : public QToolButton {
 public:
  Drawer(const QString& name, const QString& title, QWidget* content);
};

}  // namespace retint
