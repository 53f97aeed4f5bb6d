// SPDX-License-Identifier: BSD-3-Clause
// Values of JSON files that know where they stand, so that messages about one name its file, its
// line and its name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/escaped_bytes.h"

namespace retint::json {

using Json = nlohmann::ordered_json;

// The line on which each key and each list's value of a file begins, by the names that Node gives
// them ("regions[0].edit"). For files that people write.
using LineIndex = std::map<std::string, int64_t>;

// The value that `text`, the contents of `path`, stands for, and where its parts stand. InputError
// with the line for text that is not JSON and for a key that comes twice in one object.
Json ParseWithLines(const std::string& text, const std::filesystem::path& path, LineIndex* lines);

// A value of the file and where in the file it stands. Its parts outlive it.
class Node {
 public:
  Node(const Json& json, const std::filesystem::path& path, std::string name,
       const LineIndex* lines = nullptr)
      : json_(&json), path_(&path), name_(std::move(name)), lines_(lines) {}

  // InputError with the path, the line where that is known, and the value's name.
  [[noreturn]] void Fail(const std::string& fault) const;
  const Json& json() const { return *json_; }
  const std::string& name() const { return name_; }
  const std::filesystem::path& path() const { return *path_; }
  bool IsNull() const { return json_->is_null(); }
  bool Has(const char* key) const { return json_->is_object() && json_->contains(key); }
  Node At(const char* key) const;  // Fail() when there is none
  // Fail() naming the first key that is none of `known`: a slip of the pen.
  void AllowOnly(std::initializer_list<std::string_view> known) const;
  std::vector<Node> List() const;          // Fail() when it is not an array
  std::vector<Node> List(size_t n) const;  // of n values

  std::string Text() const;
  std::string Bytes() const { return UnescapeBytes(Text()); }
  bool Bool() const;
  double Number() const;  // finite
  float Float() const;    // finite as a float too
  uint64_t Unsigned(uint64_t max = std::numeric_limits<uint64_t>::max()) const;
  int Int(int min, int max) const { return static_cast<int>(Signed(min, max)); }
  uint64_t Hex() const;  // sixteen digits

 private:
  int64_t Signed(int64_t min, int64_t max) const;
  const Json* json_;
  const std::filesystem::path* path_;
  std::string name_;
  const LineIndex* lines_;
};

}  // namespace retint::json
