// SPDX-License-Identifier: BSD-3-Clause
// Options described once. A struct of options has a member `void Describe(OptionList& list)` that
// adds an entry for each of its members: name, reference, range, help, where it applies, who needs
// it. All readers and writers of options walk that list: Check(), the command line
// (apps/retint/option_flags.h), the JSON of sessions and reports (base/option_json.h), fit keys
// (editing/region.h), and forms. A new option is a member and its entry.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace retint {

// The range of a number. Not a number lies nowhere.
struct OptionRange {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false, max_open = false;  // the end itself is left out
  int multiple_of = 1;                      // of whole numbers

  static OptionRange AtLeast(double min) { return {.min = min}; }
  static OptionRange Above(double min) { return {.min = min, .min_open = true}; }
  static OptionRange Closed(double min, double max) { return {.min = min, .max = max}; }  // [ ]
  static OptionRange AboveTo(double min, double max) { return {min, max, true, false}; }  // ( ]
  static OptionRange UpTo(double min, double max) { return {min, max, false, true}; }     // [ )
  static OptionRange Between(double min, double max) { return {min, max, true, true}; }   // ( )

  bool IsUnbounded() const;
  bool Contains(double value) const;  // finite and inside
  std::string Text() const;           // "in (0, 1]", "at least 0", "finite"
};

// A member that holds one of several named values: an enum, whose values count up from 0 in the
// order of the names, or a string with one of the names.
struct OptionChoice {
  std::vector<std::string> names;
  void* member = nullptr;
  size_t (*get)(const OptionChoice& choice) = nullptr;
  void (*set)(const OptionChoice& choice, size_t index) = nullptr;

  const std::string& name() const { return names[get(*this)]; }
};

template <typename Enum>
OptionChoice ChoiceOf(Enum& member, std::vector<std::string> names) {
  static_assert(std::is_enum_v<Enum>);
  return {std::move(names), &member,
          [](const OptionChoice& c) { return static_cast<size_t>(*static_cast<Enum*>(c.member)); },
          [](const OptionChoice& c, size_t i) {
            *static_cast<Enum*>(c.member) = static_cast<Enum>(i);
          }};
}
// A string that is none of the names counts as one beyond the last.
OptionChoice ChoiceOf(std::string& member, std::vector<std::string> names);

// Who needs an option, and so where it shows. Files, Python and `--set NAME=VALUE` take every one.
enum class OptionTier {
  kRare,        // nowhere else
  kExpert,      // in the editor's forms
  kOccasional,  // also as a flag, which --help lists
  kEveryday,    // also as a flag that -h lists
};

// The value of an option, apart from its place: a choice is its name.
using OptionValue = std::variant<bool, int64_t, uint64_t, double, std::string>;

struct Option {
  std::string name;  // of the member; the key in files. Unique among those that apply alike
  std::variant<bool*, int*, uint64_t*, double*, OptionChoice> member;
  OptionRange range = {};
  std::string help = {};     // its effect, in lower case and without a full stop
  std::string title = {};    // of its row in a form, where Label() and the unit say little
  std::string unit = {};     // "pixels", of the member's value, which flags, files and Python take
                             // as it is; empty: none, or the help says it
  std::string applies = {};  // the value of a choice in the same list at which this one matters,
                             // such as "mm"; empty: always. Also the key of a group in files
  OptionTier tier = OptionTier::kRare;

  OptionValue Get() const;
  // OptionError when `value` is of another kind, out of range or no name of the choice; then
  // nothing is changed.
  void Set(const OptionValue& value) const;
  void Check() const;         // OptionError that names the option, its range and its value
  std::string Label() const;  // for people: "outside weight"
  // "--outside-weight", or empty if its tier has no flag. A switch also has a twin, "--no-around".
  std::string Flag() const;
  std::string Text() const;  // the value; a number by the digits that give it back exactly
};

using OptionList = std::vector<Option>;

// Whether the choices in `list` are such that `option`, one of it, matters.
bool Applies(const OptionList& list, const Option& option);
// The option of that name (and, of several, that group), null when there is none.
const Option* FindOption(const OptionList& list, std::string_view name,
                         std::string_view applies = "");
// Every option that applies with its value: equal texts mean equal settings to the last bit.
std::string OptionKey(const OptionList& list);

// An option and its value by themselves, for reports.
struct OptionSetting {
  std::string name, applies;
  OptionValue value;
};
std::vector<OptionSetting> AllSettings(const OptionList& list);
std::vector<OptionSetting> SettingsThatApply(const OptionList& list);

// Adds the options of a part; those that do not say where they apply do so at `applies`.
template <typename Options>
void DescribePart(Options& part, std::string_view applies, OptionList& list) {
  const size_t first = list.size();
  part.Describe(list);
  for (size_t i = first; i < list.size(); ++i) {
    if (list[i].applies.empty()) list[i].applies = applies;
  }
}

// The list of constant options, for reading: do not Set() its members.
template <typename Options>
OptionList Described(const Options& options) {
  OptionList list;
  const_cast<Options&>(options).Describe(list);
  return list;
}

// OptionError for the first value that is out of its range.
template <typename Options>
void CheckRanges(const Options& options) {
  for (const Option& option : Described(options)) option.Check();
}

}  // namespace retint
