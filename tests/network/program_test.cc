// SPDX-License-Identifier: BSD-3-Clause
#include "network/program.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;

// Programs in the shell, which have "answer.pfm" of two by one pixels to copy.
class Program : public testing::Test {
 protected:
  void SetUp() override {
    const float pixels[] = {1, 2};
    WriteFile(folder_ / "answer.pfm",
              "Pf\n2 1\n-1.0\n" + std::string(reinterpret_cast<const char*>(pixels), 8));
  }
  // `body` is run for each line; $1 and $2 are its parts.
  std::string Command(const std::string& body) {
    WriteFile(folder_ / "program.sh",
              "cd " + folder_.path().string() +
                  "\necho started >>starts\nwhile read line; do set -- $line\n" + body +
                  "\ndone\n");
    return "exec sh " + (folder_ / "program.sh").string();
  }
  // `body` is run for the first line only, and then "ok" is said; the others get answer.pfm.
  std::string FirstOnly(const std::string& body) {
    return Command("test -e once || { touch once; " + body +
                   "; echo ok; continue; }\ncp answer.pfm $2.pfm; echo ok");
  }
  ScalarImage Ask(const NetworkProgram& program) {
    const Image8 image(2, 1, 7);
    return program.Ask({&image}, monitor_);
  }
  std::string Fault(const NetworkProgram& program) {
    try {
      Ask(program);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  }
  TempFolder folder_;
  Monitor monitor_;
};

TEST_F(Program, ItsDeathIsNoticedAlthoughItsChildrenHoldItsOutput) {
  const NetworkProgram program(Command("sleep 600 & echo no GPU >&2; exit 3"));
  EXPECT_THAT(Fault(program), HasSubstr("ended with exit code 3 instead of an answer: no GPU"));
}

TEST_F(Program, AnAnswerBeforeItsDeathCounts) {
  const NetworkProgram program(Command("cp answer.pfm $2.pfm; sleep 600 & echo ok; exit 0"));
  EXPECT_EQ(Ask(program)(1, 0), 2);
}

TEST_F(Program, StartsAgainAfterAWrongAnswer) {
  // Without another program, the second question would get the first one's "ok".
  const NetworkProgram program(FirstOnly("echo bananas"));
  EXPECT_THAT(Fault(program), HasSubstr("answered 'bananas' instead of ok"));
  EXPECT_EQ(Ask(program)(1, 0), 2);
  EXPECT_EQ(Ask(program)(0, 0), 1);
  EXPECT_EQ(ReadFile(folder_ / "starts"), "started\nstarted\n");
}

TEST_F(Program, StartsAgainAfterPixelsOfNoUse) {
  const NetworkProgram program(FirstOnly("echo Pf >$2.pfm"));
  EXPECT_THAT(Fault(program), HasSubstr("is not a .pfm file"));
  EXPECT_EQ(Ask(program)(1, 0), 2);
}

TEST_F(Program, TheEndOfALongMessageIsShown) {
  const NetworkProgram program(
      Command("for i in $(seq 2000); do echo a traceback >&2; done; echo no weights >&2; exit 1"));
  EXPECT_THAT(Fault(program), HasSubstr(": no weights"));
}

}  // namespace
}  // namespace retint
