// SPDX-License-Identifier: BSD-3-Clause
// The panels of the window, a row each: their docks, menu entries, keys and the list of keys
// follow.
#pragma once

#include <vector>

#include <QKeySequence>
#include <QList>
#include <QString>
#include <QWidget>

#include "viewer/window/window_parts.h"

namespace retint {

struct WindowPanel {
  const char* id;  // names its dock in a saved layout; the command "panel.ID" goes there
  const char* title;
  Qt::Key digit;  // Alt+digit goes there
  Qt::DockWidgetArea side;
  bool is_tab;   // in one place with the panel before it on its side, else below that
  bool scrolls;  // as a whole; the others have a part that scrolls
  QWidget* (*make)(const WindowParts& parts);

  QString Aim() const;  // "Go to the Regions panel"
  QList<QKeySequence> Keys() const { return {QKeySequence(Qt::ALT | digit)}; }
};

// In the order of the key list.
const std::vector<WindowPanel>& WindowPanels();

}  // namespace retint
