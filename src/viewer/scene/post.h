// SPDX-License-Identifier: BSD-3-Clause
// Hands work to the thread that a QObject lives on, or to a pool. Qt's queues are not built for the
// thread sanitizer, which therefore cannot see that what was written before the hand-over may be
// read after it: in such a build it is told. Races of the work itself are still found.
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
  // The last copy or move is that into the queue.
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

// `work` runs on the thread of `to`, from its event loop; never, when `to` is gone by then.
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

// After QThreadPool::waitForDone(): what the jobs wrote may be read.
inline void PoolIsDone() { post_detail::Acquire(); }

}  // namespace retint
