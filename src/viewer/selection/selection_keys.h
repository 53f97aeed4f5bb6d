// SPDX-License-Identifier: BSD-3-Clause
// The keys of selection mode: a table of their actions, and of their descriptions in the list of
// keys. Those of the tools come from SelectionTools().
#pragma once

#include <functional>
#include <vector>

#include <QKeyEvent>

namespace retint {

class SelectionCanvas;

enum class SelectionAct {
  kRun,     // calls `run`, on a view that can be painted
  kAccept,  // this and the rest work while drawing, and with any modifiers
  kLeave,
  kPan,          // held
  kHideOverlay,  // held
  kTakeBack,     // only during a drawing
};

struct SelectionKey {
  int key;
  Qt::KeyboardModifiers modifiers;
  SelectionAct act;
  std::function<void(SelectionCanvas&)> run;  // empty except for kRun
  const char* what;                           // keys with the same meaning have the same text
};

// In the order of the key list.
const std::vector<SelectionKey>& SelectionKeys();
const SelectionKey* FindSelectionKey(const QKeyEvent& event);  // null: no meaning here

}  // namespace retint
