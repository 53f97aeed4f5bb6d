// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/sh_composer.h"

#include <utility>

#include "viewer/scene/failure_text.h"

namespace retint {

ShComposer::ShComposer(OnComposed on_composed)
    : on_composed_(std::move(on_composed)), thread_([this] { Loop(); }) {}

ShComposer::~ShComposer() {
  {
    std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void ShComposer::Compose(Request request) {
  {
    std::lock_guard lock(mutex_);
    pending_ = std::move(request);
  }
  changed_.notify_all();
}

void ShComposer::Drop() {
  {
    std::lock_guard lock(mutex_);
    pending_.reset();
    drop_ = true;
  }
  changed_.notify_all();
}

ColorPreview::Colors ShComposer::Work(const Request& request) {
  if (!preview_ || preview_->original() != request.original) {
    preview_ = std::make_unique<ColorPreview>(request.original, request.backend);
  }
  return preview_->Compose(request.regions, request.job);
}

void ShComposer::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    // Prepares for the next change, such as the next color of a drag.
    while (preview_ && !quit_ && !drop_ && !pending_) {
      lock.unlock();
      const bool made = preview_->MakeReady();
      lock.lock();
      if (!made) break;
    }
    changed_.wait(lock, [this] { return quit_ || drop_ || pending_; });
    if (quit_) return;
    if (std::exchange(drop_, false)) preview_.reset();
    if (!pending_) continue;
    const Request request = std::move(*pending_);
    pending_.reset();
    lock.unlock();
    Result result{{}, request.generation};
    try {
      result.colors = Work(request);
    } catch (const std::exception& failure) {
      result.failure = FailureText(failure).toStdString();
      preview_.reset();
    }
    on_composed_(result);
    lock.lock();
  }
}

}  // namespace retint
