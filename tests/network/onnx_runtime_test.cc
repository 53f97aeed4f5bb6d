// SPDX-License-Identifier: BSD-3-Clause
#include "network/onnx_runtime.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "network/onnx_model.h"
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

// With a runtime that only has the face of one (stand_in_runtime.cc).
TEST(OnnxRuntime, CudaIsTriedAndItsFailureSaidInOneLine) {
  const TempFolder folder;
  const auto file = folder / "network.onnx";
  WriteFile(file, "anything");
  setenv("RETINT_ONNX_RUNTIME", STAND_IN_RUNTIME, 1);
  const auto provider = [&](const char* fault, bool cpu_only) {
    setenv("STAND_IN_CUDA", fault, 1);
    const std::string identity = OnnxModel(file, cpu_only).Identity();
    const std::string before = "ONNX Runtime 0.0.1, ";
    return identity.substr(identity.find(before) + before.size());
  };
  EXPECT_EQ(provider("", false), "CUDA)");
  EXPECT_EQ(provider("no driver\nat gpu.cc:12", false), "CPU, because CUDA failed: no driver)");
  EXPECT_EQ(provider("no driver", true), "CPU)");
  unsetenv("STAND_IN_CUDA");
  unsetenv("RETINT_ONNX_RUNTIME");
}

}  // namespace
}  // namespace retint::ort
