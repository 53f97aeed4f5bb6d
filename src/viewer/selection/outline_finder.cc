// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/outline_finder.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "base/error.h"
#include "viewer/scene/failure_text.h"
#include "viewer/scene/post.h"

namespace retint {

OutlineFinder::OutlineFinder(QObject* parent) : QObject(parent) { pool_.setMaxThreadCount(1); }

OutlineFinder::~OutlineFinder() {
  if (running_) running_->Cancel();
  pool_.waitForDone();
  PoolIsDone();
}

void OutlineFinder::Find(uint64_t gesture, Work work, Done done) {
  const bool was_busy = IsBusy();
  std::erase_if(waiting_, [&](const Request& request) { return request.gesture == gesture; });
  waiting_.push_back({gesture, std::move(work), std::move(done)});
  if (!running_) StartNext();
  if (!was_busy) Q_EMIT busyChanged();
}

void OutlineFinder::Cancel() {
  if (!IsBusy()) return;
  waiting_.clear();
  if (running_) std::exchange(running_, nullptr)->Cancel();
  Q_EMIT busyChanged();
}

void OutlineFinder::StartNext() {
  if (waiting_.empty()) return;
  Request request = std::move(waiting_.front());
  waiting_.erase(waiting_.begin());
  running_ = std::make_shared<Monitor>();
  PostToPool(pool_, [this, monitor = running_, request = std::move(request)] {
    Mask mask;
    QString message;
    try {
      monitor->ThrowIfCancelled();
      mask = request.work(*monitor);
    } catch (const Cancelled&) {
      return;
    } catch (const std::exception& failure) {
      message = FailureText(failure);
    }
    Post(this, [this, monitor, done = request.done, mask = std::move(mask), message] {
      if (monitor != running_) return;  // it was cancelled
      running_.reset();
      StartNext();
      if (message.isEmpty()) {
        done(mask);
      } else {
        Q_EMIT failed(message);
      }
      if (!IsBusy()) Q_EMIT busyChanged();
    });
  });
}

}  // namespace retint
