// SPDX-License-Identifier: BSD-3-Clause
#include "retint/edit_flags.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "recolor/edit_text.h"
#include "retint/common.h"
#include "retint/help.h"

namespace retint::cli {

namespace {

// Pictures of several views are one operation, at the place of the first. Whether there is one.
bool AddPicture(ColorEdit& edit, const ColorOperation& op) {
  for (ColorOperation& other : edit.operations) {
    if (other.kind != ColorOperationKind::kPicture) continue;
    CheckOption(op.strength == other.strength,
                "--edited: its pictures are one edit, so give all the same strength");
    std::vector<EditedPicture> pictures = other.picture->pictures;
    pictures.push_back(op.picture->pictures.front());
    other = ColorOperation::Picture(std::move(pictures));
    other.strength = op.strength;
    return true;
  }
  return false;
}

}  // namespace

void EditFlags::Add(CLI::App* verb, const std::string& group) {
  verb_ = verb;
  for (const ColorOperationType& type : ColorOperationTypes()) {
    const std::string flag = std::string("--") + type.option;
    CLI::Option* option = *type.syntax == 0
                              ? verb->add_flag(flag, counts_[type.name], type.help)->default_str("")
                              : verb->add_option(flag, values_[type.name], type.help)
                                    ->allow_extra_args(false)
                                    ->default_str("")
                                    ->type_name(type.syntax);
    types_[option->group(group)] = &type;
    if (type.tier == OptionTier::kEveryday) Everyday(verb, option);
  }
  types_[Everyday(verb, verb->add_option("--edit", files_,
                                         "Operations from a file (.json), or those of a report")
                            ->allow_extra_args(false)
                            ->default_str("")
                            ->type_name("FILE")
                            ->group(group))] = nullptr;
  verb->add_option("--keep-lightness", keep_lightness_,
                   "With --to: 0 takes the target's lightness, 1 keeps every pixel's own")
      ->check(CLI::Range(0.0, 1.0))
      ->expected(1)
      ->default_str("0")
      ->group(group);
  strength_flag_ = Everyday(
      verb, verb->add_option("--strength", strength_,
                             "Strength of the whole edit, 0 to 1. For one operation: --exposure "
                             "1,strength=0.5")
                ->check(CLI::Range(0.0, 1.0))
                ->group(group));
}

bool EditFlags::Given() const {
  return strength_flag_->count() > 0 || !keep_lightness_.empty() ||
         std::any_of(types_.begin(), types_.end(),
                     [](const auto& entry) { return entry.first->count() > 0; });
}

ColorEdit EditFlags::Resolve(Run& run) const {
  ColorEdit edit;
  std::vector<std::string> warnings;
  std::map<const CLI::Option*, size_t> next;
  bool any_to = false;
  std::string with_strength;  // a file whose list has one
  size_t lists = 0, others = 0;
  for (const CLI::Option* option : verb_->parse_order()) {
    const auto found = types_.find(option);
    if (found == types_.end()) continue;
    std::string text = option->results().at(next[option]++);
    if (!found->second) {
      const ColorEdit more = ReadEdit(text, &warnings);
      if (more.strength != 1) with_strength = text;
      edit.strength = more.strength;
      ++lists;
      edit.operations.insert(edit.operations.end(), more.operations.begin(), more.operations.end());
      continue;
    }
    const ColorOperationType& type = *found->second;
    CheckOption(*type.syntax != 0 || text == "true",
                fmt::format("--{} takes no value, not '{}'", type.option, text));
    if (type.kind == ColorOperationKind::kRecolor) {
      any_to = true;
      if (!keep_lightness_.empty()) {
        text += fmt::format(",keep-lightness={}", keep_lightness_.back());
      }
    }
    ColorOperation op = ParseOperation(type, *type.syntax == 0 ? "" : text, &warnings);
    ++others;
    if (type.kind == ColorOperationKind::kPicture && AddPicture(edit, op)) continue;
    edit.operations.push_back(std::move(op));
  }
  CheckOption(!edit.operations.empty(),
              "there is no edit: give --to or another operation, or --edit FILE");
  CheckOption(any_to || keep_lightness_.empty(), "--keep-lightness requires --to");
  if (strength_flag_->count() > 0) {
    edit.strength = 1;
  } else if (!with_strength.empty() && lists + others > 1) {
    throw InputError(with_strength,
                     "has a strength of its whole list, and other operations are given too; say "
                     "with --strength what that of all is");
  }
  edit.Check();
  for (const std::string& warning : warnings) run.Warn(warning);
  return edit;
}

}  // namespace retint::cli
