// SPDX-License-Identifier: BSD-3-Clause
// Undo and redo of value edits. A state is a RegionSet; the history is a list of them with a
// cursor. It moves only when a whole new state is handed over, so a failed or cancelled edit leaves
// it untouched.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "editing/region.h"

namespace retint {

class EditHistory {
 public:
  // Oldest states are dropped when the states together hold more than `byte_budget`; the current
  // one always stays.
  explicit EditHistory(size_t byte_budget = size_t{512} << 20);

  const RegionSet& current() const { return entries_[cursor_].state; }
  // Forgets every state and starts anew from this one.
  void Restart(RegionSet state);
  // Replaces the fit of a region of the current state: derived data, not an edit.
  void SetFit(RegionId id, std::shared_ptr<const RegionFit> fit);

  // Makes `state` current and forgets undone states. A non-empty `merge_key` equal to the last
  // edit's replaces that edit, so that a drag of a slider is one step; EndMerge() ends the drag.
  void Push(std::string label, RegionSet state, std::string_view merge_key = "");
  void EndMerge() { entries_[cursor_].merge_key.clear(); }

  bool CanUndo() const { return cursor_ > 0; }
  bool CanRedo() const { return cursor_ + 1 < entries_.size(); }
  // Labels of the edit that Undo() or Redo() would take back or repeat; empty when there is none.
  std::string UndoLabel() const { return CanUndo() ? entries_[cursor_].label : ""; }
  std::string RedoLabel() const { return CanRedo() ? entries_[cursor_ + 1].label : ""; }
  // Of every edit that is kept, the oldest first. The first `steps_done()` of them are done, the
  // others were undone.
  std::vector<std::string> Labels() const;
  size_t steps_done() const { return cursor_; }
  bool Undo();  // false when there is nothing to undo
  bool Redo();
  size_t bytes() const;  // held by all states together, shared parts of neighbors counted once

 private:
  struct Entry {
    std::string label, merge_key;
    RegionSet state;
  };
  void Trim();

  size_t byte_budget_;
  std::vector<Entry> entries_;  // entries_[0] is the oldest state that can be returned to
  size_t cursor_ = 0;
};

}  // namespace retint
