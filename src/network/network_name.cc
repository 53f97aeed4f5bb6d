// SPDX-License-Identifier: BSD-3-Clause
#include "network/network_name.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "base/error.h"

namespace retint {
namespace {

// Takes ",key=value" off the end of `rest`; false if it does not end so. File names have commas.
bool TakeSetting(std::string* rest, std::map<std::string, std::string>* settings) {
  const size_t comma = rest->rfind(',');
  if (comma == std::string::npos) return false;
  const std::string setting = rest->substr(comma + 1);
  const size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) return false;
  const std::string key = setting.substr(0, equals);
  if (!std::ranges::all_of(key, [](char c) { return c >= 'a' && c <= 'z'; })) return false;
  settings->emplace(key, setting.substr(equals + 1));
  rest->resize(comma);
  return true;
}

}  // namespace

std::string NetworkName::SettingsText() const {
  std::string all;
  for (const auto& [key, value] : settings) {
    if (key != "provider") all += (all.empty() ? " with " : ", ") + key + "=" + value;
  }
  return all;
}

double NetworkName::Number(const std::string& key, double otherwise, double least,
                           double most) const {
  const auto found = settings.find(key);
  if (found == settings.end()) return otherwise;
  const std::string& value = found->second;
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  // Written so that NaN is refused.
  const bool is_fine = error == std::errc() && end == value.data() + value.size() &&
                       number >= least && number <= most;
  CheckOption(is_fine, fmt::format("{}: {} must be a number in [{}, {}], not '{}'", text, key,
                                   least, most, value));
  return number;
}

std::string NetworkName::OneOf(const std::string& key, const std::string& otherwise,
                               std::initializer_list<std::string_view> values) const {
  const auto found = settings.find(key);
  if (found == settings.end()) return otherwise;
  CheckOption(std::ranges::find(values, found->second) != values.end(),
              fmt::format("{}: {} must be one of {}, not '{}'", text, key, fmt::join(values, ", "),
                          found->second));
  return found->second;
}

NetworkName ParseNetworkName(const std::string& text,
                             std::initializer_list<std::string_view> keys) {
  constexpr std::string_view kOnnx = "onnx:", kExec = "exec:";
  NetworkName name;
  name.text = text;
  if (text.starts_with(kExec)) {
    name.command = text.substr(kExec.size());
    CheckOption(!name.command.empty(), "exec: needs a command, such as exec:'python3 stereo.py'");
    return name;
  }
  CheckOption(text.starts_with(kOnnx), "'" + text + "' is neither onnx:FILE nor exec:COMMAND");
  std::string rest = text.substr(kOnnx.size());
  while (TakeSetting(&rest, &name.settings)) continue;
  CheckOption(!rest.empty(), "onnx: needs a file, such as onnx:stereo.onnx");
  name.file = rest;
  for (const auto& [key, value] : name.settings) {
    CheckOption(
        std::ranges::find(keys, key) != keys.end(),
        fmt::format("{}: there is no setting '{}'; known: {}", text, key, fmt::join(keys, ", ")));
  }
  return name;
}

}  // namespace retint
