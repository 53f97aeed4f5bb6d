// SPDX-License-Identifier: BSD-3-Clause
#include "retint/option_flags.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <iterator>
#include <set>

namespace retint::cli {
namespace {

// "mm: what it does, pixels"; of several that share a flag, one after the other.
std::string HelpOf(const std::vector<Option>& alike) {
  std::string help;
  for (const Option& option : alike) {
    const std::string text = option.help + (option.unit.empty() ? "" : ", " + option.unit);
    help += help.empty() ? "" : "; ";
    help += option.applies.empty() ? text : option.applies + ": " + text;
  }
  if (alike.front().applies.empty()) {
    help[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(help[0])));
  }
  return help;
}

std::string DefaultOf(const std::vector<Option>& alike) {
  std::string text = alike.front().Text();
  for (const Option& option : alike) {
    if (option.Text() != alike.front().Text()) text += "|" + option.Text();
  }
  return text;
}

// Refuses a number outside the range while the flag's name is still known; what is no number is
// left to the conversion.
CLI::Validator InRange(const Option& option) {
  return {[range = option.range](const std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            const bool is_number = end != text.c_str() && *end == '\0';
            return !is_number || range.Contains(value)
                       ? std::string()
                       : "must be " + range.Text() + ", not " + text;
          },
          option.range.Text()};
}

template <typename Number>
CLI::Option* AddNumber(CLI::App* verb, const std::string& flag, const std::vector<Option>& alike) {
  CLI::Option* added = verb->add_option_function<Number>(
      flag,
      [alike](const Number& value) {
        for (const Option& option : alike) {
          if constexpr (std::is_same_v<Number, int>) {
            option.Set(int64_t{value});
          } else {
            option.Set(value);
          }
        }
      },
      HelpOf(alike));
  for (const Option& option : alike) {
    const bool any = option.range.IsUnbounded() && option.range.multiple_of == 1;
    if (!any) return added->check(InRange(option));
  }
  return added;
}

CLI::Option* AddChoice(CLI::App* verb, const std::string& flag, const std::vector<Option>& alike) {
  return verb
      ->add_option_function<std::string>(
          flag,
          [alike](const std::string& name) {
            for (const Option& option : alike) option.Set(name);
          },
          HelpOf(alike))
      ->check(CLI::IsMember(std::get<OptionChoice>(alike.front().member).names));
}

CLI::Option* AddFlag(CLI::App* verb, const std::string& flag, const std::vector<Option>& alike) {
  const auto& member = alike.front().member;
  if (const auto* toggle = std::get_if<bool*>(&member)) {
    return verb->add_flag(flag + ",!--no-" + flag.substr(2), **toggle, HelpOf(alike))
        ->option_text(**toggle ? "(default: on)" : "(default: off)");
  }
  CLI::Option* added =
      std::holds_alternative<OptionChoice>(member) ? AddChoice(verb, flag, alike)
      : std::holds_alternative<double*>(member)    ? AddNumber<double>(verb, flag, alike)
      : std::holds_alternative<int*>(member)       ? AddNumber<int>(verb, flag, alike)
                                                   : AddNumber<uint64_t>(verb, flag, alike);
  return added->default_str(DefaultOf(alike));
}

}  // namespace

void OptionFlags::Add(CLI::App* verb, const std::string& group, const OptionList& options,
                      const std::vector<std::pair<std::string, std::string>>& rename) {
  std::set<std::string> done;
  for (const Option& option : options) {
    if (option.flag.empty() || !done.insert(option.flag).second) continue;
    std::vector<Option> alike;
    std::copy_if(options.begin(), options.end(), std::back_inserter(alike),
                 [&](const Option& other) { return other.flag == option.flag; });
    std::string flag = option.flag;
    for (const auto& [from, to] : rename) {
      if (from == option.flag) flag = to;
    }
    flags_.emplace_back(option.flag, AddFlag(verb, flag, alike)->group(group));
  }
}

bool OptionFlags::Given(const std::string& flag) const {
  return std::any_of(flags_.begin(), flags_.end(), [&](const auto& entry) {
    return entry.first == flag && entry.second->count() > 0;
  });
}

void OptionFlags::TakeOver(const OptionList& preset, const OptionList& options) const {
  for (size_t i = 0; i < options.size(); ++i) {
    if (!Given(options[i].flag)) options[i].Set(preset[i].Get());
  }
}

}  // namespace retint::cli
