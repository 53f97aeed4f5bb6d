// SPDX-License-Identifier: BSD-3-Clause
#include "base/option_json.h"

#include <algorithm>
#include <optional>

#include "base/error.h"

namespace retint::json {
namespace {

std::optional<Node> Find(const Node& node, const Option& option) {
  const char* name = option.name.c_str();
  const char* group = option.applies.c_str();
  if (!option.applies.empty() && node.Has(group) && node.At(group).Has(name)) {
    return node.At(group).At(name);
  }
  return node.Has(name) ? std::optional(node.At(name)) : std::nullopt;
}

OptionValue Read(const Node& node, const Option& option) {
  if (std::holds_alternative<bool*>(option.member)) return node.Bool();
  if (std::holds_alternative<double*>(option.member)) return node.Number();
  if (std::holds_alternative<uint64_t*>(option.member)) return node.Unsigned();
  if (std::holds_alternative<int*>(option.member)) {
    constexpr auto kLimits = std::numeric_limits<int>();
    return int64_t{node.Int(kLimits.min(), kLimits.max())};
  }
  return node.Text();
}

}  // namespace

Json OptionsJson(const std::vector<OptionSetting>& settings) {
  Json json = Json::object();
  for (const OptionSetting& setting : settings) {
    Json& object = setting.applies.empty() ? json : json[setting.applies];
    std::visit([&](const auto& value) { object[setting.name] = value; }, setting.value);
  }
  return json;
}

void ReadOptions(const Node& node, const OptionList& options) {
  if (!node.json().is_object()) node.Fail("is not an object");
  for (const Option& option : options) {
    const std::optional<Node> found = Find(node, option);
    if (!found) continue;
    try {
      option.Set(Read(*found, option));
    } catch (const OptionError& error) {
      found->Fail(error.what());
    }
  }
}

void AllowOnlyOptions(const Node& node, const OptionList& options) {
  if (!node.json().is_object()) node.Fail("is not an object");
  const auto is_group = [&](const std::string& key) {
    return std::any_of(options.begin(), options.end(),
                       [&](const Option& option) { return option.applies == key; });
  };
  for (const auto& [key, value] : node.json().items()) {
    const Node child = node.At(key.c_str());
    if (FindOption(options, key)) continue;
    if (!is_group(key)) child.Fail("there is no such option");
    if (!value.is_object()) child.Fail("is not an object of options");
    for (const auto& [name, unused] : value.items()) {
      if (!FindOption(options, name, key)) child.At(name.c_str()).Fail("there is no such option");
    }
  }
}

}  // namespace retint::json
