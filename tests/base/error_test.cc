// SPDX-License-Identifier: BSD-3-Clause
#include "base/error.h"

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(ErrorTest, InputErrorNamesFileLineAndFault) {
  EXPECT_STREQ(InputError("empty selection").what(), "empty selection");
  EXPECT_STREQ(InputError(std::filesystem::path("a/b.bin"), "truncated").what(),
               "a/b.bin: truncated");
  EXPECT_STREQ(InputError(std::filesystem::path(), "no such view").what(), "no such view");
  EXPECT_STREQ(InputError(std::filesystem::path("a.txt"), 12, "QW is NaN").what(),
               "a.txt:12: QW is NaN");
}

TEST(ErrorTest, CheckOptionThrowsOnlyWhenFalse) {
  EXPECT_NO_THROW(CheckOption(true, "unused"));
  try {
    CheckOption(false, "--tint: must not be negative");
    FAIL() << "did not throw";
  } catch (const OptionError& error) {
    EXPECT_STREQ(error.what(), "--tint: must not be negative");
  }
}

TEST(ErrorTest, KindsAreTold) {
  // The CLI maps each kind to its own exit code, so none may be a kind of another.
  EXPECT_THROW(throw InputError("x"), Error);
  EXPECT_FALSE((std::is_base_of_v<InputError, RunError>));
  EXPECT_FALSE((std::is_base_of_v<RunError, InputError>));
  EXPECT_FALSE((std::is_base_of_v<OptionError, InputError>));
  EXPECT_TRUE((std::is_base_of_v<Error, Cancelled>));
}

}  // namespace
}  // namespace retint
