// SPDX-License-Identifier: BSD-3-Clause
#include "base/option_name.h"

#include <algorithm>

namespace retint {
namespace {

// Stands as a word. A path may contain a name in backticks, too, but with more of the path around.
bool IsWord(std::string_view message, size_t first, size_t last) {
  const std::string_view before = message.substr(0, first);
  std::string_view after = message.substr(last + 1);
  after.remove_prefix(std::min(after.find_first_not_of(",;:.)"), after.size()));
  return (before.empty() || before.back() == ' ' || before.back() == '(') &&
         (after.empty() || after.front() == ' ');
}

std::string KeyOf(std::string_view name) {
  std::string key(name);
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

bool IsKey(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

std::string OptionName(std::string_view name) { return '`' + KeyOf(name) + '`'; }

std::string OptionName(std::string_view name, std::string_view value) {
  return '`' + KeyOf(name) + '=' + std::string(value) + '`';
}

std::string SpellOptions(std::string_view message, const OptionSpelling& spell) {
  std::string spelled;
  size_t done = 0;
  for (size_t first = message.find('`'); first != std::string::npos;) {
    const size_t last = message.find('`', first + 1);
    if (last == std::string::npos) break;
    const std::string_view text = message.substr(first + 1, last - first - 1);
    const size_t equals = text.find('=');
    const std::string_view name = text.substr(0, equals);
    if (!IsKey(name) || !IsWord(message, first, last)) {
      first = last;
      continue;
    }
    spelled += message.substr(done, first - done);
    spelled += spell(name, equals == std::string::npos ? "" : text.substr(equals + 1));
    done = last + 1;
    first = message.find('`', done);
  }
  return spelled += message.substr(done);
}

}  // namespace retint
