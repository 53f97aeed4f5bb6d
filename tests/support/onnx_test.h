// SPDX-License-Identifier: BSD-3-Clause
// Tests that run networks: skipped if ONNX Runtime is not installed, and only then.
#pragma once

#include <string>

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "base/monitor.h"
#include "network/onnx_runtime.h"
#include "tests/support/data.h"

namespace retint {

class OnnxTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      ort::LoadRuntime();
    } catch (const OptionError& error) {
      const std::string why = error.what();
      if (why.find("is not installed") == std::string::npos) FAIL() << why;
      GTEST_SKIP() << why;
    }
  }
  // The path of a file with these bytes.
  std::string Write(const std::string& name, const std::string& bytes) {
    WriteFile(folder_ / name, bytes);
    return (folder_ / name).string();
  }
  TempFolder folder_;
  Monitor monitor_;
};

}  // namespace retint
