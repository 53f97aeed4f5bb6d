// SPDX-License-Identifier: BSD-3-Clause
// Results of stages on disk, by their inputs: a stage whose inputs did not change is read instead
// of computed again. An entry is a folder <stage>-<32 hexadecimal digits>, put in place whole, so
// that a job that is cut off leaves every stage that it finished.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "base/checksum.h"

namespace retint {

// 128 bits of everything that a stage depends on, in the order in which it is added.
class StageKey {
 public:
  explicit StageKey(std::string_view stage) { Add(stage); }
  // Texts are told apart from their neighbors by their lengths.
  StageKey& Add(std::string_view bytes);
  template <typename T>
  StageKey& AddValue(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    return Add({reinterpret_cast<const char*>(&value), sizeof(T)});
  }
  std::string Hex() const;  // 32 digits

 private:
  Xxh64Stream first_, second_;
  bool started_ = false;
};

class StageCache {
 public:
  // With an empty path, and for an empty key, nothing is found and nothing is kept.
  explicit StageCache(std::filesystem::path folder);
  bool IsThere() const { return !folder_.empty(); }

  bool Has(const std::string& stage, const std::string& key) const;
  // Calls `read` with the entry's folder. False when there is none, and when `read` throws
  // InputError (the entry is damaged): then it is removed.
  bool Read(const std::string& stage, const std::string& key,
            const std::function<void(const std::filesystem::path& folder)>& read);
  // Calls `write` with a folder to fill, then puts it in place. RunError when it cannot be written.
  void Write(const std::string& stage, const std::string& key,
             const std::function<void(const std::filesystem::path& folder)>& write);
  // Removes the entries that were not used for longest until the rest have at most `most_bytes`.
  // Entries that Read() found or Write() put there since this object was made are kept.
  void Trim(uint64_t most_bytes);

 private:
  std::filesystem::path Entry(const std::string& stage, const std::string& key) const;

  std::filesystem::path folder_;
  std::filesystem::file_time_type start_;
};

}  // namespace retint
