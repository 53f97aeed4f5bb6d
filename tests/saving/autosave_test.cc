// SPDX-License-Identifier: BSD-3-Clause
#include "saving/autosave.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "tests/saving/saved_scene.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

class AutosaveTest : public ::testing::Test {
 protected:
  AutosaveTest() {
    setenv("XDG_DATA_HOME", (folder_ / "data").c_str(), 1);
    WriteTinyScene(scene_, folder_.path());
    session_ = OpenTinyScene(folder_.path());
    session_->scene().splat_checksum().wait();  // a forked child has no thread to compute it
  }
  ~AutosaveTest() override { unsetenv("XDG_DATA_HOME"); }

  fs::path Session() const { return folder_ / "edit.retint"; }
  SessionSnapshot Snapshot() const {
    SessionSnapshot snapshot = TakeSnapshot(*session_);
    snapshot.saved = Session();
    return snapshot;
  }
  FloatArray LoadSh(const fs::path& path) const {
    SessionOptions options;
    options.backend = "cpu";
    Monitor monitor;
    return OpenSession(path, options, monitor).session->refits().CurrentSh();
  }

  const TinyScene scene_{31};
  const TempFolder folder_;
  std::unique_ptr<EditSession> session_;
};

TEST_F(AutosaveTest, WritesBesideTheSessionAndElseInTheDataFolder) {
  const Autosave saved(Session()), unsaved({}), again(Session());
  EXPECT_EQ(saved.folder(), folder_ / "edit.autosave.retint");
  EXPECT_EQ(again.folder(), folder_ / "edit.autosave-2.retint");
  EXPECT_EQ(unsaved.folder(), folder_ / "data/retint/autosave/untitled.autosave.retint");
  const Autosave nowhere(folder_ / "none" / "edit.retint");
  EXPECT_EQ(nowhere.folder(), folder_ / "data/retint/autosave/edit.autosave.retint");
}

TEST_F(AutosaveTest, TheNewestChangeIsOnDisk) {
  Autosave autosave(Session());
  EditTinyScene(scene_, *session_);
  for (int i = 0; i < 30; ++i) {
    const float tint = 0.02F * static_cast<float>(i + 1);
    session_->store().Do(SetEdit{1, ColorEdit::Tint({tint, 1, tint})});
    autosave.Submit(Snapshot());
  }
  autosave.Flush();
  EXPECT_EQ(autosave.error(), "");
  EXPECT_TRUE(SameBits(LoadSh(autosave.folder()), session_->refits().CurrentSh()));
}

TEST_F(AutosaveTest, SubmittingCostsNothingAndTheWriterIsAnotherThread) {
  std::thread::id writer;
  Autosave autosave(Session(), [&](const std::string&) { writer = std::this_thread::get_id(); });
  EditTinyScene(scene_, *session_);
  const SessionSnapshot snapshot = Snapshot();
  EXPECT_EQ(snapshot.regions.regions[0].selection, session_->store().regions().regions[0].selection)
      << "heavy parts are shared";
  autosave.Submit(snapshot);
  autosave.Flush();
  EXPECT_NE(writer, std::this_thread::get_id());
  EXPECT_NE(writer, std::thread::id());
}

TEST_F(AutosaveTest, ALivingProgramsAutosaveIsNotOffered) {
  EditTinyScene(scene_, *session_);
  {
    Autosave autosave(Session());
    autosave.Submit(Snapshot());
    autosave.Flush();
    EXPECT_TRUE(FindRecoverable({Session()}).empty());
  }
  const auto found = FindRecoverable({Session()});
  ASSERT_EQ(found.size(), 1u) << "its program is gone";
  EXPECT_EQ(found[0].session, Session());
  EXPECT_EQ(found[0].info.regions, 2u);
  // The next program does not write over it.
  const Autosave next(Session());
  EXPECT_NE(next.folder(), found[0].folder);
  RemoveRecovery(found[0]);
  EXPECT_TRUE(FindRecoverable({Session()}).empty());
}

TEST_F(AutosaveTest, DiscardingLeavesNothing) {
  EditTinyScene(scene_, *session_);
  {
    Autosave autosave(Session());
    autosave.Submit(Snapshot());
    autosave.Flush();
    ASSERT_TRUE(IsFile(autosave.folder() / "session.json"));
    autosave.Discard();
    EXPECT_FALSE(fs::exists(autosave.folder()));
    autosave.Submit(Snapshot());
    autosave.Flush();
    EXPECT_TRUE(SameBits(LoadSh(autosave.folder()), session_->refits().CurrentSh())) << "made anew";
    autosave.Submit(Snapshot());
    autosave.Discard();
  }
  size_t entries = 0;
  for (const auto& entry : fs::directory_iterator(folder_.path())) {
    EXPECT_THAT(entry.path().filename().string(), ::testing::AnyOf("ws", "data"));
    ++entries;
  }
  EXPECT_EQ(entries, 2u);
}

TEST_F(AutosaveTest, OneThatIsOlderThanTheSessionIsNotOffered) {
  EditTinyScene(scene_, *session_);
  {
    Autosave autosave(Session());
    autosave.Submit(Snapshot());
  }
  Monitor monitor;
  SessionWriter(Session()).Write(Snapshot(), monitor);
  const auto now = fs::last_write_time(Session() / "session.json");
  fs::last_write_time(Session() / "session.json", now + std::chrono::seconds(10));
  EXPECT_TRUE(FindRecoverable({Session()}).empty());
}

TEST_F(AutosaveTest, AFailureIsReportedAndTheNextWriteTriesAgain) {
  EditTinyScene(scene_, *session_);
  std::vector<std::string> errors;
  Autosave autosave(Session(), [&](const std::string& error) { errors.push_back(error); });
  WriteFile(autosave.folder(), "in the way");
  autosave.Submit(Snapshot());
  autosave.Flush();
  EXPECT_THAT(autosave.error(), ::testing::HasSubstr("edit.autosave.retint"));
  fs::remove(autosave.folder());
  autosave.Submit(Snapshot());
  autosave.Flush();
  EXPECT_EQ(autosave.error(), "");
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_TRUE(SameBits(LoadSh(autosave.folder()), session_->refits().CurrentSh()));
}

// A child edits and autosaves in an endless loop, and is killed at some moment. Its last accepted
// state, or the one before, must be there, complete.
TEST_F(AutosaveTest, SurvivesKillMinusNine) {
  EditTinyScene(scene_, *session_);
  const GaussianModel& model = session_->scene().original();
  TestRandom random(3);
  for (int round = 0; round < 6; ++round) {
    int ready[2];
    ASSERT_EQ(pipe(ready), 0);
    const pid_t child = fork();
    if (child == 0) {
      Autosave autosave(Session());
      SessionSnapshot snapshot = Snapshot();
      for (int i = 0;; ++i) {
        // A selection of its own every time: the write is as long as it gets.
        Region& region = snapshot.regions.regions[0];
        auto selection = std::make_shared<RegionSelection>(*region.selection);
        selection->id = static_cast<uint64_t>(1000 + i);
        region.selection = std::move(selection);
        region.fit = nullptr;
        region.strength = static_cast<float>(i % 100) / 100.0F;
        autosave.Submit(snapshot);
        autosave.Flush();
        if (i == 1 && write(ready[1], "r", 1) != 1) _exit(1);
      }
    }
    ASSERT_GT(child, 0);
    char byte = 0;
    ASSERT_EQ(read(ready[0], &byte, 1), 1);
    std::this_thread::sleep_for(std::chrono::microseconds(int(random.Uniform(0, 60000))));
    ASSERT_EQ(kill(child, SIGKILL), 0);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    close(ready[0]);
    close(ready[1]);

    const auto found = FindRecoverable({Session()});
    ASSERT_EQ(found.size(), 1u);
    SessionOptions options;
    options.backend = "cpu";
    Monitor monitor;
    const OpenedSession opened = OpenSession(found[0].folder, options, monitor);
    const auto& regions = opened.session->store().regions().regions;
    ASSERT_EQ(regions.size(), 2u);
    const auto i = static_cast<int>(regions[0].selection->id - 1000);
    EXPECT_EQ(regions[0].strength, static_cast<float>(i % 100) / 100.0F) << "of one moment";
    EXPECT_EQ(regions[0].selection->masks.size(), MasksOf(scene_).size());
    EXPECT_EQ(opened.session->refits().CurrentSh().size(), model.sh.size());
    RemoveRecovery(found[0]);
  }
}

}  // namespace
}  // namespace retint
