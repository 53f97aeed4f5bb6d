// SPDX-License-Identifier: BSD-3-Clause
// The keys of selection mode, the same in every profile: what they do and how the list of keys
// describes it, in one table.
#pragma once

#include <vector>

#include <QKeyEvent>

namespace retint {

class SelectionCanvas;

enum class SelectionAct {
  kRun,     // `run`, on a view that can be painted
  kAccept,  // the rest goes with the current drawing, and with any modifiers
  kLeave,
  kPan,          // held
  kHideOverlay,  // held
  kTakeBack,     // only while something is drawn
};

struct SelectionKey {
  int key;
  Qt::KeyboardModifiers modifiers;
  SelectionAct act;
  void (*run)(SelectionCanvas& canvas);  // null but for kRun
  const char* what;                      // keys with one meaning have one text
};

// In the order of the key list.
const std::vector<SelectionKey>& SelectionKeys();
const SelectionKey* FindSelectionKey(const QKeyEvent& event);  // null: it means nothing here

}  // namespace retint
