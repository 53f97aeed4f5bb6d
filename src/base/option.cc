// SPDX-License-Identifier: BSD-3-Clause
#include "base/option.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>

#include "base/error.h"

namespace retint {
namespace {

template <typename... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <typename... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

// The fewest digits that give the number back exactly.
template <typename Number>
std::string Digits(Number value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof(text), value).ptr;
  return {text, end};
}

std::string Joined(const std::vector<std::string>& names) {
  std::string joined;
  for (size_t i = 0; i < names.size(); ++i) {
    joined += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  }
  return joined;
}

// False when `value` is no number, or not one that the type of the member can hold.
template <typename Number>
bool Convert(const OptionValue& value, Number* out) {
  const auto whole = [&](auto v) {
    *out = static_cast<Number>(v);
    if constexpr (std::is_integral_v<Number>) return std::in_range<Number>(v);
    return true;
  };
  const auto* number = std::get_if<double>(&value);
  if (number && std::is_floating_point_v<Number>) {
    *out = static_cast<Number>(*number);
    return true;
  }
  if (const auto* v = std::get_if<int64_t>(&value)) return whole(*v);
  if (const auto* v = std::get_if<uint64_t>(&value)) return whole(*v);
  return false;
}

}  // namespace

bool OptionRange::IsUnbounded() const { return std::isinf(min) && std::isinf(max); }

bool OptionRange::Contains(double value) const {
  return std::isfinite(value) && (min_open ? value > min : value >= min) &&
         (max_open ? value < max : value <= max) &&
         (multiple_of == 1 || std::fmod(value, multiple_of) == 0);
}

std::string OptionRange::Text() const {
  std::string text;
  if (IsUnbounded()) {
    text = "finite";
  } else if (std::isinf(max)) {
    text = (min_open ? "above " : "at least ") + Digits(min);
  } else if (std::isinf(min)) {
    text = (max_open ? "below " : "at most ") + Digits(max);
  } else {
    text = std::string("in ") + (min_open ? "(" : "[") + Digits(min) + ", " + Digits(max) +
           (max_open ? ")" : "]");
  }
  return multiple_of == 1 ? text : text + ", a multiple of " + Digits(multiple_of);
}

OptionChoice ChoiceOf(std::string& member, std::vector<std::string> names) {
  return {
      std::move(names), &member,
      [](const OptionChoice& c) {
        const auto found =
            std::find(c.names.begin(), c.names.end(), *static_cast<std::string*>(c.member));
        return static_cast<size_t>(found - c.names.begin());
      },
      [](const OptionChoice& c, size_t i) { *static_cast<std::string*>(c.member) = c.names[i]; }};
}

OptionValue Option::Get() const {
  return std::visit(Overloaded{[](const bool* v) -> OptionValue { return *v; },
                               [](const int* v) -> OptionValue { return int64_t{*v}; },
                               [](const uint64_t* v) -> OptionValue { return *v; },
                               [](const double* v) -> OptionValue { return *v; },
                               [](const OptionChoice& c) -> OptionValue {
                                 const size_t index = c.get(c);
                                 return index < c.names.size() ? c.names[index] : std::string("?");
                               }},
                    member);
}

void Option::Set(const OptionValue& value) const {
  const auto number = [&](auto* to) {
    auto wanted = *to;
    CheckOption(Convert(value, &wanted), Label() + " cannot be set to a value of another kind");
    const auto before = std::exchange(*to, wanted);
    try {
      Check();
    } catch (const OptionError&) {
      *to = before;
      throw;
    }
  };
  const auto choice = [&](const OptionChoice& c) {
    const auto* wanted = std::get_if<std::string>(&value);
    const auto found = wanted ? std::find(c.names.begin(), c.names.end(), *wanted) : c.names.end();
    CheckOption(found != c.names.end(), Label() + " must be " + Joined(c.names) +
                                            (wanted ? ", not '" + *wanted + "'" : ""));
    c.set(c, static_cast<size_t>(found - c.names.begin()));
  };
  const auto toggle = [&](bool* to) {
    CheckOption(std::holds_alternative<bool>(value), Label() + " is either true or false");
    *to = std::get<bool>(value);
  };
  std::visit(Overloaded{toggle, [&](int* to) { number(to); }, [&](uint64_t* to) { number(to); },
                        [&](double* to) { number(to); }, choice},
             member);
}

void Option::Check() const {
  if (const auto* choice = std::get_if<OptionChoice>(&member)) {
    CheckOption(choice->get(*choice) < choice->names.size(),
                Label() + " must be " + Joined(choice->names));
    return;
  }
  if (std::holds_alternative<bool*>(member)) return;
  const double value = std::visit(
      Overloaded{[](int* v) { return double(*v); }, [](uint64_t* v) { return double(*v); },
                 [](double* v) { return *v; }, [](const auto&) { return 0.0; }},
      member);
  CheckOption(range.Contains(value), Label() + " must be " + range.Text() +
                                         (unit.empty() ? "" : " " + unit) + ", not " +
                                         Digits(value));
}

std::string Option::Label() const {
  std::string label = name;
  std::replace(label.begin(), label.end(), '_', ' ');
  return label;
}

std::string Option::Flag() const {
  if (tier < OptionTier::kOccasional) return {};
  std::string flag = "--" + name;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string Option::Text() const {
  return std::visit(
      Overloaded{[](bool v) { return std::string(v ? "true" : "false"); },
                 [](int64_t v) { return Digits(v); }, [](uint64_t v) { return Digits(v); },
                 [](double v) { return Digits(v); }, [](const std::string& v) { return v; }},
      Get());
}

bool Applies(const OptionList& list, const Option& option) {
  if (option.applies.empty()) return true;
  for (const Option& other : list) {
    const auto* choice = std::get_if<OptionChoice>(&other.member);
    if (!choice || &other == &option) continue;
    if (std::find(choice->names.begin(), choice->names.end(), option.applies) ==
        choice->names.end()) {
      continue;
    }
    return std::get<std::string>(other.Get()) == option.applies && Applies(list, other);
  }
  return true;  // nothing in this list decides about it
}

const Option* FindOption(const OptionList& list, std::string_view name, std::string_view applies) {
  for (const Option& option : list) {
    if (option.name == name && (applies.empty() || option.applies == applies)) return &option;
  }
  return nullptr;
}

std::vector<OptionSetting> AllSettings(const OptionList& list) {
  std::vector<OptionSetting> settings;
  for (const Option& option : list) {
    settings.push_back({option.name, option.applies, option.Get()});
  }
  return settings;
}

std::vector<OptionSetting> SettingsThatApply(const OptionList& list) {
  OptionList applying;
  std::copy_if(list.begin(), list.end(), std::back_inserter(applying),
               [&](const Option& option) { return Applies(list, option); });
  return AllSettings(applying);
}

std::string OptionKey(const OptionList& list) {
  std::string key;
  for (const Option& option : list) {
    if (!Applies(list, option)) continue;
    key += option.applies + '.' + option.name + '=' + option.Text() + ';';
  }
  return key;
}

}  // namespace retint
