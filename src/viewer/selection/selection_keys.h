// SPDX-License-Identifier: BSD-3-Clause
// The keys of selection mode, the same in every profile: a table of their actions, and of their
// descriptions in the list of keys.
#pragma once

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
  void (*run)(SelectionCanvas& canvas);  // null except for kRun
  const char* what;                      // keys with the same meaning have the same text
};

// In the order of the key list.
const std::vector<SelectionKey>& SelectionKeys();
const SelectionKey* FindSelectionKey(const QKeyEvent& event);  // null: no meaning here

}  // namespace retint
