// SPDX-License-Identifier: BSD-3-Clause
#include "editing/history.h"

#include <utility>

namespace retint {

EditHistory::EditHistory(size_t byte_budget) : byte_budget_(byte_budget), entries_(1) {}

void EditHistory::Restart(RegionSet state) {
  std::vector<Entry> fresh(1);
  fresh[0].state = std::move(state);
  entries_ = std::move(fresh);
  cursor_ = 0;
}

void EditHistory::SetFit(RegionId id, std::shared_ptr<const RegionFit> fit) {
  if (Region* region = entries_[cursor_].state.Find(id)) region->fit = std::move(fit);
}

void EditHistory::Push(std::string label, RegionSet state, std::string_view merge_key) {
  const bool merge =
      cursor_ > 0 && !merge_key.empty() && !CanRedo() && entries_[cursor_].merge_key == merge_key;
  if (merge) {
    entries_[cursor_].state = std::move(state);
    return;
  }
  // Reserved first: from here on nothing throws, and the history is either old or new.
  entries_.reserve(cursor_ + 2);
  Entry entry{std::move(label), std::string(merge_key), std::move(state)};
  entries_.resize(cursor_ + 1);
  entries_.push_back(std::move(entry));
  ++cursor_;
  Trim();
}

std::vector<std::string> EditHistory::Labels() const {
  std::vector<std::string> labels;
  for (size_t i = 1; i < entries_.size(); ++i) labels.push_back(entries_[i].label);
  return labels;
}

bool EditHistory::Undo() {
  if (!CanUndo()) return false;
  EndMerge();
  --cursor_;
  return true;
}

bool EditHistory::Redo() {
  if (!CanRedo()) return false;
  ++cursor_;
  EndMerge();
  return true;
}

size_t EditHistory::bytes() const {
  size_t total = entries_[0].state.BytesBeyond({});
  for (size_t i = 1; i < entries_.size(); ++i) {
    total += entries_[i].state.BytesBeyond(entries_[i - 1].state);
  }
  return total;
}

void EditHistory::Trim() {
  while (cursor_ > 0 && bytes() > byte_budget_) {
    entries_.erase(entries_.begin());
    --cursor_;
    entries_[0].label.clear();
  }
}

}  // namespace retint
