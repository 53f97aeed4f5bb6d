// SPDX-License-Identifier: BSD-3-Clause
// How users name a network: "onnx:FILE[,key=value...]" or "exec:COMMAND".
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <string_view>

namespace retint {

struct NetworkName {
  std::string text;                             // as typed
  std::filesystem::path file;                   // of onnx:
  std::string command;                          // of exec:
  std::map<std::string, std::string> settings;  // of onnx:

  bool IsProgram() const { return !command.empty(); }
  // " with scale=-1, values=255": for identities, of which the device is another part.
  std::string SettingsText() const;
  // OptionError unless the setting, if it is given, is a finite number in [least, most].
  double Number(const std::string& key, double otherwise, double least, double most) const;
  // OptionError unless the setting, if it is given, is one of `values`.
  std::string OneOf(const std::string& key, const std::string& otherwise,
                    std::initializer_list<std::string_view> values) const;
};

// OptionError if `text` is neither, and for a setting that is not in `keys`.
NetworkName ParseNetworkName(const std::string& text, std::initializer_list<std::string_view> keys);

}  // namespace retint
