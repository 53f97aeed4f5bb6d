// SPDX-License-Identifier: BSD-3-Clause
// The place of real captures and of files from other programs, and a scratch folder that cleans up
// after itself.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace retint {

// $RETINT_DATA, else shared/data beside the checkout. May not exist: use RETINT_REQUIRE_DATA.
inline std::filesystem::path DataPath(const std::string& relative = "") {
  const char* root = std::getenv("RETINT_DATA");
  const std::filesystem::path base =
      root ? std::filesystem::path(root)
           : std::filesystem::path(RETINT_SOURCE_DIR) / ".." / "shared" / "data";
  return relative.empty() ? base : base / relative;
}

// Skips the test, visibly, where the file or folder is missing.
#define RETINT_REQUIRE_DATA(relative)                           \
  do {                                                          \
    if (!std::filesystem::exists(::retint::DataPath(relative))) \
      GTEST_SKIP() << "needs " << ::retint::DataPath(relative); \
  } while (false)

// A fresh folder under the system's temporary one, removed with everything in it.
class TempFolder {
 public:
  TempFolder() {
    std::random_device random;
    path_ = std::filesystem::temp_directory_path() /
            ("retint-test-" + std::to_string(random()) + std::to_string(random()));
    std::filesystem::create_directories(path_);
  }
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace retint
