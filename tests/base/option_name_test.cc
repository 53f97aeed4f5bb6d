// SPDX-License-Identifier: BSD-3-Clause
#include "base/option_name.h"

#include <gtest/gtest.h>

namespace retint {
namespace {

std::string AsFlags(std::string_view message) {
  return SpellOptions(message, [](std::string_view name, std::string_view value) {
    return "--" + std::string(name) + (value.empty() ? "" : " ") + std::string(value);
  });
}

TEST(OptionName, IsSpelledByEachProgram) {
  const std::string message = OptionName("memory", "96") + " is enough, or " +
                              OptionName("backend", "cpu") + " (" + OptionName("views") + ").";
  EXPECT_EQ(message, "`memory=96` is enough, or `backend=cpu` (`views`).");
  EXPECT_EQ(AsFlags(message), "--memory 96 is enough, or --backend cpu (--views).");
  EXPECT_EQ(OptionName("white-balance"), "`white_balance`");
  EXPECT_EQ(AsFlags(OptionName("to", "'#3060ff,from=#c8b478'") + ", " + OptionName("edit")),
            "--to '#3060ff,from=#c8b478', --edit");
}

TEST(OptionName, LeavesOtherBackticksAsTheyAre) {
  for (const char* const text :
       {"", "no name", "`", "a ` b", "`retint convert` makes it binary", "images/`views`.jpg",
        "`views`.jpg", "``", "`Views`", "it's `a", "x`views` y"}) {
    EXPECT_EQ(AsFlags(text), text);
  }
  EXPECT_EQ(AsFlags("`retint convert` with `drop`"), "`retint convert` with --drop");
  EXPECT_EQ(AsFlags("a ` b `views` c"), "a ` b --views c");
}

}  // namespace
}  // namespace retint
