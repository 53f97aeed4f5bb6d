// SPDX-License-Identifier: BSD-3-Clause
// Passes work to the thread of a QObject, or to a pool. The thread sanitizer does not know Qt's
// queues, and would report reads of data that was written before the hand-over. A build with it
// gets this information here. It still finds races of the work itself.
#pragma once

#include <utility>

#include <QMetaObject>
#include <QThreadPool>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace retint {
namespace post_detail {

#if defined(__SANITIZE_THREAD__)
inline char handed_over;
inline void Release() { __tsan_release(&handed_over); }
inline void Acquire() { __tsan_acquire(&handed_over); }
#else
inline void Release() {}
inline void Acquire() {}
#endif

template <typename Work>
class Handed {
 public:
  explicit Handed(Work work) : work_(std::move(work)) {}
  // The last copy or move puts the work into the queue.
  Handed(const Handed& other) : work_(other.work_) { Release(); }
  Handed(Handed&& other) noexcept : work_(std::move(other.work_)) { Release(); }
  ~Handed() { Acquire(); }
  void operator()() {
    Acquire();
    work_();
    Release();
  }

 private:
  Work work_;
};

}  // namespace post_detail

// Runs `work` on the thread of `to`, from its event loop; never if `to` no longer exists.
template <typename Work>
void Post(QObject* to, Work work) {
  post_detail::Handed<Work> handed(std::move(work));
  QMetaObject::invokeMethod(to, std::move(handed), Qt::QueuedConnection);
}

template <typename Work>
void PostToPool(QThreadPool& pool, Work work, int priority = 0) {
  post_detail::Handed<Work> handed(std::move(work));
  pool.start(std::move(handed), priority);
}

// After QThreadPool::waitForDone(): allows reading the results of the jobs.
inline void PoolIsDone() { post_detail::Acquire(); }

}  // namespace retint
