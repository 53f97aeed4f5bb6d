// SPDX-License-Identifier: BSD-3-Clause
#include "retint/option_flags.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <type_traits>

#include "base/edit_distance.h"
#include "base/error.h"
#include "retint/common.h"
#include "retint/help.h"

namespace retint::cli {
namespace {

constexpr const char* kSet = "--set";

// Refuses a number outside the range while the flag's name is still known; text that is no number
// is left to the conversion.
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
Number NumberFrom(const Option& option, const std::string& text) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value);
  CheckOption(error != std::errc::result_out_of_range,
              option.name + ": '" + text + "' is out of range");
  CheckOption(error == std::errc() && at == end,
              option.name + ": '" + text + "' is not a " +
                  (std::is_integral_v<Number> ? "whole number" : "number"));
  return value;
}

// The part of a name after its stage and group.
std::string LastOf(std::string_view name) {
  const size_t dot = name.rfind('.');
  std::string last(name.substr(dot == std::string_view::npos ? 0 : dot + 1));
  std::replace(last.begin(), last.end(), '-', '_');
  return last;
}

// How to go on after a name that is no option of the verb.
std::string Suggestion(const std::vector<StageOption>& all, const std::string& name) {
  if (const std::string stage = StageOf(name); !stage.empty()) {
    return " of this command; " + VerbsOfStage(stage) + " have it";
  }
  constexpr int kMostWrong = 2;
  const std::string last = LastOf(name);
  const auto distance = [&](const StageOption& one) { return EditDistance(last, one.option.name); };
  const auto best = std::ranges::min_element(all, {}, distance);
  const bool is_alike = best != all.end() && distance(*best) <= kMostWrong &&
                        2 * distance(*best) < static_cast<int>(last.size());
  return is_alike ? "; did you mean " + best->option.name + "?" : "; `retint options` lists them";
}

}  // namespace

std::string StageOption::FullName() const {
  return stage + "." + (option.applies.empty() ? "" : option.applies + ".") + option.name;
}

bool StageOption::IsNamed(std::string_view name) const {
  const size_t dot = name.rfind('.');
  if (LastOf(name) != option.name) return false;
  if (dot == std::string_view::npos) return true;
  const std::string_view group = name.substr(0, dot);
  return group == stage || group == option.applies || group == stage + "." + option.applies;
}

void SetFromText(const Option& option, const std::string& text) {
  if (std::holds_alternative<bool*>(option.member)) {
    CheckOption(text == "true" || text == "false",
                option.name + " is either true or false, not '" + text + "'");
    option.Set(text == "true");
  } else if (std::holds_alternative<OptionChoice>(option.member)) {
    option.Set(text);
  } else if (std::holds_alternative<double*>(option.member)) {
    option.Set(NumberFrom<double>(option, text));
  } else if (std::holds_alternative<uint64_t*>(option.member)) {
    option.Set(NumberFrom<uint64_t>(option, text));
  } else {
    option.Set(int64_t{NumberFrom<int>(option, text)});
  }
}

void OptionFlags::Set(const std::string& text, const std::string& flag) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw CLI::ValidationError(flag, "'" + text + "' has no value: write NAME=VALUE");
  }
  const std::string name = text.substr(0, equals);
  bool any = false;
  for (const StageOption& one : all_) {
    if (!one.IsNamed(name)) continue;
    try {
      SetFromText(one.option, text.substr(equals + 1));
    } catch (const OptionError& error) {
      throw CLI::ValidationError(flag + " " + text, error.what());
    }
    typed_.emplace(one.option.applies, one.option.name);
    typed_stages_.insert(one.stage);
    any = true;
  }
  if (any) return;
  throw CLI::ValidationError(flag, "there is no option '" + name + "'" + Suggestion(all_, name));
}

void OptionFlags::AddFlag(CLI::App* verb, const std::string& group, const Option& option) {
  const std::string flag = option.Flag();
  const auto mark = [this, option] { typed_.emplace(option.applies, option.name); };
  const std::string help = HelpOf(option);
  CLI::Option* added = nullptr;
  if (std::holds_alternative<bool*>(option.member)) {
    added = verb->add_flag_function(
        flag + ",!--no-" + flag.substr(2),
        [option, mark](int64_t count) {
          option.Set(count > 0);
          mark();
        },
        help);
  } else {
    added = verb->add_option_function<std::string>(
        flag,
        [option, mark, flag](const std::string& text) {
          try {
            SetFromText(option, text);
          } catch (const OptionError&) {
            throw CLI::ConversionError(flag, std::vector<std::string>{text});
          }
          mark();
        },
        help);
    if (const auto* choice = std::get_if<OptionChoice>(&option.member)) {
      added->check(CLI::IsMember(choice->names));
    } else {
      const bool is_whole = !std::holds_alternative<double*>(option.member);
      added->type_name(is_whole ? "INT" : "FLOAT");
      const bool any = option.range.IsUnbounded() && option.range.multiple_of == 1;
      if (!any) added->check(InRange(option));
    }
    added->default_str(option.Text());
  }
  if (option.tier == OptionTier::kEveryday) Everyday(verb, added);
  added->group(group);
}

void OptionFlags::Add(CLI::App* verb, const std::string& stage, const std::string& group,
                      const OptionList& options) {
  bool all_have_flags = true;
  for (const Option& option : options) {
    all_.push_back({stage, option});
    if (option.Flag().empty()) {
      all_have_flags = false;
    } else {
      AddFlag(verb, group, option);
    }
  }
  if (all_have_flags || verb->get_option_no_throw(kSet)) return;
  verb->add_option_function<std::vector<std::string>>(
          kSet,
          [this](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) Set(text, kSet);
          },
          "Any option by its name in job files, such as mm.ridge_rest=1e-2; repeatable. `retint "
          "options` explains them")
      ->allow_extra_args(false)
      ->type_name("NAME=VALUE")
      ->group(kOtherOptions);
}

void OptionFlags::TakeOver(const OptionList& preset, const OptionList& options) const {
  for (size_t i = 0; i < options.size(); ++i) {
    if (!typed_.contains({options[i].applies, options[i].name})) options[i].Set(preset[i].Get());
  }
}

}  // namespace retint::cli
