// SPDX-License-Identifier: BSD-3-Clause
// Finding and calling NCCL, with the test's own library in its place.
#include "cluster/nccl.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class NcclTest : public testing::Test {
 protected:
  ~NcclTest() override {
    for (const char* name : {"RETINT_NCCL", "FAKE_NCCL_LOG", "FAKE_NCCL_FAILS"}) unsetenv(name);
  }

  static const Nccl* Find(const std::string& file) {
    setenv("RETINT_NCCL", file.c_str(), 1);
    fault_.clear();
    return FindNccl(&fault_);
  }
  const Nccl& Fake(const char* failing) {
    setenv("FAKE_NCCL_LOG", (folder_ / "log").c_str(), 1);
    setenv("FAKE_NCCL_FAILS", failing, 1);
    const Nccl* const nccl = Find(RETINT_FAKE_NCCL);
    if (!nccl) throw std::runtime_error(fault_);
    return *nccl;
  }
  // The calls.
  std::string Log() const {
    std::ostringstream text;
    text << std::ifstream(folder_ / "log").rdbuf();
    return text.str();
  }

  TempFolder folder_;
  static inline std::string fault_;
};

TEST_F(NcclTest, CanBeTurnedOff) {
  EXPECT_EQ(Find("off"), nullptr);
  EXPECT_EQ(fault_, "RETINT_NCCL=off");
}

TEST_F(NcclTest, AFileThatIsNotThereIsTold) {
  EXPECT_EQ(Find("/nonexistent/libnccl.so.2"), nullptr);
  EXPECT_THAT(fault_, AllOf(HasSubstr("/nonexistent/libnccl.so.2"), Not(HasSubstr("\n"))));
}

TEST_F(NcclTest, AFileThatIsNoLibraryIsTold) {
  std::ofstream(folder_ / "nccl.so") << "text";
  EXPECT_EQ(Find((folder_ / "nccl.so").string()), nullptr);
  EXPECT_THAT(fault_, HasSubstr("nccl.so"));
}

TEST_F(NcclTest, ALibraryThatLacksAFunctionIsTold) {
  EXPECT_EQ(Find(RETINT_OLD_NCCL), nullptr);
  EXPECT_THAT(fault_, AllOf(HasSubstr(RETINT_OLD_NCCL), HasSubstr("ncclSend")));
  EXPECT_EQ(Find("libm.so.6"), nullptr);
  EXPECT_THAT(fault_, HasSubstr("ncclGetVersion"));
}

TEST_F(NcclTest, TransfersAreOneGroup) {
  const Nccl& nccl = Fake("");
  NcclId id;
  nccl.Check(nccl.get_unique_id(&id), "ncclGetUniqueId");
  {
    const auto link = JoinNccl(nccl, id, 1, 3);
    EXPECT_EQ(link->Name(), "NCCL 2.13.4");
    int value = 0;
    char stream[] = "S";
    const std::vector<DeviceTransfer> sends = {{0, &value, 4}, {2, &value, 3}};
    const std::vector<DeviceTransfer> receives = {{0, &value, 2}};
    link->Transfer(sends, receives, stream);
    EXPECT_TRUE(link->IsReady());
  }
  // First a little from each to each, on a stream of CUDA's.
  EXPECT_EQ(Log(),
            "id\njoin 1 of 3 by 7\ntake\nstart\nsend 16 of type 1, rank 0, stream of CUDA\n"
            "send 16 of type 1, rank 2, stream of CUDA\n"
            "receive 16 of type 1, rank 0, stream of CUDA\n"
            "receive 16 of type 1, rank 2, stream of CUDA\nend\n"
            "earlier\nstart\nsend 4 of type 1, rank 0, stream S\n"
            "send 3 of type 1, rank 2, stream S\nreceive 2 of type 1, rank 0, stream S\nend\n"
            "leave\nfree\n");
}

// The error of a transfer if `failing` fails.
std::string FaultOf(const Nccl& nccl) {
  const auto link = JoinNccl(nccl, {}, 0, 2);
  int value = 0;
  char stream[] = "S";
  const std::vector<DeviceTransfer> one = {{1, &value, 4}};
  try {
    link->Transfer(one, one, stream);
  } catch (const RunError& error) {
    return error.what();
  }
  return "";
}

TEST_F(NcclTest, FailuresAreOneLine) {
  EXPECT_EQ(FaultOf(Fake("")), "");
  const std::string more = ": internal error (a cable was pulled); RETINT_NCCL=off does without it";
  EXPECT_EQ(FaultOf(Fake("join 0 of 2 by 0")), "NCCL: ncclCommInitRank" + more);
  EXPECT_EQ(FaultOf(Fake("take")), "NCCL: ncclMemAlloc" + more);
  EXPECT_EQ(FaultOf(Fake("earlier")), "NCCL: an earlier transfer" + more);
  EXPECT_EQ(FaultOf(Fake("send 4 of type 1, rank 1, stream S")), "NCCL: ncclSend" + more);
  EXPECT_EQ(FaultOf(Fake("receive 4 of type 1, rank 1, stream S")), "NCCL: ncclRecv" + more);
  EXPECT_EQ(FaultOf(Fake("end")), "NCCL: ncclGroupEnd" + more);
}

TEST_F(NcclTest, WhatWasNeverJoinedIsNotLeft) {
  const Nccl& nccl = Fake("join 0 of 2 by 0");
  JoinNccl(nccl, {}, 0, 2);
  EXPECT_EQ(Log(), "join 0 of 2 by 0\n");
}

}  // namespace
}  // namespace retint
