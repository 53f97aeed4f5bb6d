// SPDX-License-Identifier: BSD-3-Clause
// Internal to session: session.json to and from values. Reading throws InputError with the file and
// the key at fault.
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "session/checksum.h"
#include "session/session_file.h"

namespace retint::session_json {

using Json = nlohmann::ordered_json;

inline constexpr const char* kManifest = "session.json";
inline constexpr const char* kFormat = "retint-session";

// A name that is bytes (an image's) as text that is UTF-8: '%', control characters and, where the
// whole is not UTF-8, bytes above 127 become %XX.
std::string EscapeBytes(std::string_view bytes);
std::string UnescapeBytes(std::string_view text);

// A value of the file and where in the file it stands.
class Node {
 public:
  Node(const Json& json, const std::filesystem::path& path, std::string name)
      : json_(&json), path_(&path), name_(std::move(name)) {}

  [[noreturn]] void Fail(const std::string& fault) const {
    throw InputError(*path_, (name_.empty() ? "" : name_ + ": ") + fault);
  }
  const Json& json() const { return *json_; }
  const std::filesystem::path& path() const { return *path_; }
  bool IsNull() const { return json_->is_null(); }
  bool Has(const char* key) const { return json_->is_object() && json_->contains(key); }
  Node At(const char* key) const;          // Fail() when there is none
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
};

// The file, parsed; its format and version checked.
Json ReadManifest(const std::filesystem::path& folder);

Json JobJson(const RefitJob& job);
RefitJob ReadJob(const Node& node);
Json EditJson(const Region& region);  // id, name, visible, strength, edit
void ReadEdit(const Node& node, Region* region);
Json CameraJson(const PosedCamera& view);
PosedCamera ReadCamera(const Node& node);  // a pinhole of 1 to 65535 pixels a side
Json ReportJson(const PaintedReport& report);
PaintedReport ReadReport(const Node& node);
Json SummaryJson(const RefitSummary& summary);
RefitSummary ReadSummary(const Node& node);

// A path as {"relative": to `folder`'s parent, "absolute"}; moves with the session, and is found
// where only the session moved.
Json PathJson(const std::filesystem::path& path, const std::filesystem::path& folder);
// Where it may be, likeliest first.
std::vector<std::filesystem::path> ReadPaths(const Node& node, const std::filesystem::path& folder);

}  // namespace retint::session_json
