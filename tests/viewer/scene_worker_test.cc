// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/scene_worker.h"

#include <future>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

// Notes which tasks end, how, and where.
class SceneWorkerTest : public ::testing::Test {
 protected:
  SceneWorker::Task Task(
      const QString& label, const std::string& name, std::function<void()> work = [] {}) {
    return {label, [work](Monitor&) { work(); },
            [this, name](std::exception_ptr error) { Note(name, error); }};
  }
  // Those of all tasks so far.
  std::vector<std::string> Ends() {
    std::promise<void> last;
    worker_.Post({{}, [&](Monitor&) { last.set_value(); }, {}});
    last.get_future().wait();
    return ends_;
  }
  void Note(std::string name, std::exception_ptr error) {
    try {
      if (error) std::rethrow_exception(error);
    } catch (const Cancelled&) {
      name += " cancelled";
    }
    if (std::this_thread::get_id() == test_) name += " by the test";
    ends_.push_back(name);
  }

  const std::thread::id test_ = std::this_thread::get_id();
  std::vector<std::string> ends_, told_;
  SceneWorker worker_{[](const Progress&) {},
                      [this](const QString& label) { told_.push_back(label.toStdString()); }};
};

TEST_F(SceneWorkerTest, CancelledTasksEndInTheirTurnOnTheWorker) {
  std::promise<void> began, gate;
  worker_.Post(Task("running", "running", [&, opened = gate.get_future().share()] {
    began.set_value();
    opened.wait();
  }));
  began.get_future().wait();
  worker_.Post(Task({}, "quick"));
  worker_.Post(Task("waiting", "waiting", [] { FAIL() << "it was cancelled"; }));
  worker_.Post(Task({}, "quick too"));
  worker_.Cancel();
  worker_.Post(Task("later", "later"));
  gate.set_value();
  EXPECT_EQ(Ends(), (std::vector<std::string>{"running", "quick", "waiting cancelled", "quick too",
                                              "later"}));
  EXPECT_EQ(told_, (std::vector<std::string>{"running", "", "later", ""}));
}

TEST_F(SceneWorkerTest, OneTaskIsCancelledByItsMonitor) {
  std::promise<void> gate;
  worker_.Post(Task({}, "running", [opened = gate.get_future().share()] { opened.wait(); }));
  const auto monitor = worker_.Post(Task("first", "first"));
  worker_.Post(Task("second", "second"));
  monitor->Cancel();
  gate.set_value();
  EXPECT_EQ(Ends(), (std::vector<std::string>{"running", "first cancelled", "second"}));
}

}  // namespace
}  // namespace retint
