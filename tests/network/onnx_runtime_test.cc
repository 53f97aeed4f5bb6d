// SPDX-License-Identifier: BSD-3-Clause
#include "network/onnx_runtime.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "tests/support/data.h"

namespace retint::ort {
namespace {

TEST(OnnxRuntime, ALibraryThatIsThereAndCannotBeLoadedIsNamed) {
  const TempFolder folder;
  const auto place = folder.path() / "lib/python3.11/site-packages/onnxruntime/capi";
  std::filesystem::create_directories(place);
  WriteFile(place / "libonnxruntime.so", "no library");
  unsetenv("RETINT_ONNX_RUNTIME");
  setenv("VIRTUAL_ENV", folder.path().c_str(), 1);
  try {
    EXPECT_FALSE(LoadRuntime().version.empty()) << "another one works";
  } catch (const OptionError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr((place / "libonnxruntime.so").string()));
    EXPECT_THAT(error.what(), testing::HasSubstr("RETINT_ONNX_RUNTIME"));
  }
}

}  // namespace
}  // namespace retint::ort
