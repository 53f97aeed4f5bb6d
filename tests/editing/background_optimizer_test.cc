// SPDX-License-Identifier: BSD-3-Clause
// Run these under the thread sanitizer: the job has no kernels, so its findings are ours.
#include "editing/background_optimizer.h"

#include <atomic>
#include <chrono>
#include <semaphore>
#include <stdexcept>

#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

using State = BackgroundOptimizer::State;
using namespace std::chrono_literals;

// Waits for a certain event; false after 20 s, which is far too long for any of them.
template <typename Condition>
bool Eventually(Condition condition) {
  const auto end = std::chrono::steady_clock::now() + 20s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

// Where a job waits until the test lets it pass.
class Gate {
 public:
  void Pass() {
    waiting_.release();
    open_.acquire();
  }
  void AwaitJob() { waiting_.acquire(); }
  void Open(int times = 1) { open_.release(times); }

 private:
  std::counting_semaphore<> waiting_{0}, open_{0};
};

// Every coefficient equals the number of steps taken: a torn snapshot would show two values.
class CountingJob : public OptimizerJob {
 public:
  CountingJob(int steps, std::atomic<int>* alive = nullptr, int fail_at = -1)
      : sh_(5000, 0.0F), steps_(steps), fail_at_(fail_at), alive_(alive) {
    if (alive_) ++*alive_;
  }
  ~CountingJob() override {
    if (alive_) --*alive_;
  }
  bool Step(Monitor& monitor) override {
    monitor.ThrowIfCancelled();
    if (taken_ == fail_at_) throw std::runtime_error("the step failed");
    if (taken_ == steps_) return false;
    ++taken_;
    for (float& value : sh_) value += 1;
    if (taken) taken->store(taken_);
    if (gate) gate->Pass();
    return true;
  }
  ShSnapshot Snapshot() const override {
    if (copies) ++*copies;
    ShSnapshot snapshot;
    snapshot.sh = std::make_shared<const FloatArray>(sh_);
    return snapshot;
  }

  std::atomic<int>*copies = nullptr, *taken = nullptr;  // counted for a test
  Gate* gate = nullptr;                                 // at the end of each step

 private:
  FloatArray sh_;
  int steps_, taken_ = 0, fail_at_;
  std::atomic<int>* alive_;
};

BackgroundOptimizer::Factory Counting(int steps, std::atomic<int>* alive = nullptr,
                                      int fail_at = -1) {
  return [=](Monitor&) { return std::make_unique<CountingJob>(steps, alive, fail_at); };
}

constexpr int kEndless = 1 << 30;

TEST(BackgroundOptimizer, RunsToTheEndAndPublishesTheLastState) {
  BackgroundOptimizer optimizer;
  EXPECT_EQ(optimizer.state(), State::kIdle);
  EXPECT_EQ(optimizer.Newest(), nullptr);
  const uint64_t job = optimizer.Start(Counting(7));
  optimizer.Wait();
  EXPECT_EQ(optimizer.state(), State::kFinished);
  const auto newest = optimizer.Newest();
  ASSERT_NE(newest, nullptr);
  EXPECT_EQ(newest->job, job);
  EXPECT_TRUE(newest->finished);
  EXPECT_EQ(newest->sh->front(), 7);
}

TEST(BackgroundOptimizer, ReadersSeeOnlyWholeStatesInOrder) {
  BackgroundOptimizer optimizer;
  optimizer.Start(Counting(300));
  float last = -1;
  bool torn = false, backwards = false;
  while (optimizer.state() == State::kRunning) {
    const auto newest = optimizer.Newest();
    if (!newest) continue;
    const float value = newest->sh->front();
    for (const float other : *newest->sh) torn = torn || other != value;
    backwards = backwards || value < last;
    last = value;
  }
  EXPECT_FALSE(torn);
  EXPECT_FALSE(backwards);
  optimizer.Wait();
  EXPECT_EQ(optimizer.Newest()->sh->back(), 300);
}

TEST(BackgroundOptimizer, CancelStopsAnEndlessJobAndFreesIt) {
  std::atomic<int> alive{0};
  Gate gate;
  BackgroundOptimizer optimizer;
  optimizer.Start([&](Monitor&) {
    auto job = std::make_unique<CountingJob>(kEndless, &alive);
    job->gate = &gate;
    return job;
  });
  gate.AwaitJob();
  optimizer.Newest();  // asks for the state after this step
  gate.Open();
  gate.AwaitJob();
  EXPECT_EQ(optimizer.Newest()->steps, 1);
  optimizer.Cancel();
  gate.Open();
  optimizer.Wait();
  EXPECT_EQ(optimizer.state(), State::kCancelled);
  EXPECT_EQ(alive.load(), 0);
  EXPECT_EQ(optimizer.Newest()->steps, 1) << "published after it was cancelled";
  EXPECT_FALSE(optimizer.Newest()->finished);
}

TEST(BackgroundOptimizer, ANewJobOvertakesTheOneBefore) {
  std::atomic<int> alive{0};
  BackgroundOptimizer optimizer;
  uint64_t last = 0;
  for (int i = 0; i < 50; ++i) last = optimizer.Start(Counting(kEndless, &alive));
  last = optimizer.Start(Counting(3, &alive));
  optimizer.Wait();
  EXPECT_EQ(optimizer.state(), State::kFinished);
  EXPECT_EQ(optimizer.Newest()->job, last);
  EXPECT_EQ(optimizer.Newest()->sh->front(), 3);
  EXPECT_EQ(alive.load(), 0);
}

TEST(BackgroundOptimizer, PausesBetweenStepsAndGoesOn) {
  std::atomic<int> taken{0};
  Gate gate;
  BackgroundOptimizer optimizer;
  optimizer.Start([&](Monitor&) {
    auto job = std::make_unique<CountingJob>(kEndless);
    job->taken = &taken;
    job->gate = &gate;
    return job;
  });
  gate.AwaitJob();
  optimizer.Pause();
  EXPECT_EQ(optimizer.state(), State::kPaused);
  gate.Open(3);  // for two more steps, were it not paused
  EXPECT_TRUE(Eventually([&] { return optimizer.Newest()->steps == 1; }));
  EXPECT_EQ(taken.load(), 1);
  optimizer.Resume();
  for (int step = 2; step <= 4; ++step) gate.AwaitJob();
  EXPECT_EQ(taken.load(), 4);
  optimizer.Pause();
  gate.Open();
  EXPECT_TRUE(Eventually([&] { return optimizer.Newest()->steps == 4; }));
  optimizer.Cancel();  // a paused job can be cancelled
  gate.Open();         // had it gone on
  optimizer.Wait();
  EXPECT_EQ(optimizer.state(), State::kCancelled);
  EXPECT_EQ(taken.load(), 4);
}

TEST(BackgroundOptimizer, AFailureIsKeptAndTheNextJobRuns) {
  BackgroundOptimizer* self = nullptr;
  BackgroundOptimizer optimizer([&] { self->Newest(); });  // asks for every state
  self = &optimizer;
  optimizer.Start(Counting(10, nullptr, /*fail_at=*/4));
  optimizer.Wait();
  EXPECT_EQ(optimizer.state(), State::kFailed);
  EXPECT_EQ(optimizer.error(), "the step failed");
  EXPECT_EQ(optimizer.Newest()->sh->front(), 4);
  optimizer.Start([](Monitor&) -> std::unique_ptr<OptimizerJob> { throw InputError("no such"); });
  optimizer.Wait();
  EXPECT_EQ(optimizer.error(), "no such");
  optimizer.Start(Counting(2));
  optimizer.Wait();
  EXPECT_EQ(optimizer.state(), State::kFinished);
  EXPECT_EQ(optimizer.error(), "");
}

// A state that nobody asks for is not copied: the first and the last are.
TEST(BackgroundOptimizer, CopiesOnlyWhatIsAskedFor) {
  std::atomic<int> copies{0};
  const auto counting = [&](Monitor&) {
    auto job = std::make_unique<CountingJob>(1000);
    job->copies = &copies;
    return job;
  };
  BackgroundOptimizer optimizer;
  optimizer.Start(counting);
  optimizer.Wait();
  EXPECT_EQ(copies.load(), 2);
  const auto last = optimizer.Newest();
  EXPECT_EQ(last->sh->front(), 1000);
  EXPECT_EQ(last->steps, 1001);  // the last one found nothing left to do
  // Asking before a job starts asks for nothing of it.
  optimizer.Start(counting);
  optimizer.Wait();
  EXPECT_EQ(copies.load(), 4);
}

TEST(BackgroundOptimizer, PausingShowsTheStateThatItPausedAt) {
  std::atomic<int> taken{0};
  BackgroundOptimizer optimizer;
  optimizer.Start([&](Monitor&) {
    auto job = std::make_unique<CountingJob>(kEndless);
    job->taken = &taken;
    return job;
  });
  ASSERT_TRUE(Eventually([&] { return taken.load() > 20; }));  // nobody asks meanwhile
  optimizer.Pause();
  // The step in progress ends, then its state comes.
  EXPECT_TRUE(Eventually([&] {
    const int steps = taken.load();
    return steps > 20 && optimizer.Newest()->steps == steps && taken.load() == steps;
  }));
  const auto newest = optimizer.Newest();
  EXPECT_EQ(newest->sh->front(), static_cast<float>(newest->steps));
  optimizer.Cancel();
  optimizer.Wait();
}

TEST(BackgroundOptimizer, DestructionStopsWhatRuns) {
  std::atomic<int> alive{0};
  for (int i = 0; i < 20; ++i) {
    BackgroundOptimizer optimizer;
    optimizer.Start(Counting(kEndless, &alive));
    if (i % 2 == 1) Eventually([&] { return optimizer.Newest() != nullptr; });
  }
  EXPECT_EQ(alive.load(), 0);
}

TEST(BackgroundOptimizer, TellsOfEverySnapshotWithoutHoldingALock) {
  std::atomic<int> calls{0};
  BackgroundOptimizer* self = nullptr;
  std::atomic<bool> ready{false};
  BackgroundOptimizer optimizer([&] {
    if (!ready) return;
    ++calls;
    self->Newest();  // would deadlock under the lock
    self->state();
  });
  self = &optimizer;
  ready = true;
  optimizer.Start(Counting(5));
  optimizer.Wait();
  // The start, five steps, the step that found nothing left, the end.
  EXPECT_EQ(calls.load(), 8);
}

}  // namespace
}  // namespace retint
