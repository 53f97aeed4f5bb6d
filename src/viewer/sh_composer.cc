// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/sh_composer.h"

#include <utility>

#include "session/refit_chain.h"

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

void ShComposer::Loop() {
  GaussianModel scratch;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return quit_ || drop_ || pending_; });
    if (quit_) return;
    if (std::exchange(drop_, false)) scratch = {};
    if (!pending_) continue;
    const Request request = std::move(*pending_);
    pending_.reset();
    lock.unlock();
    const GaussianModel& original = *request.original;
    if (scratch.NumGaussians() != original.NumGaussians() ||
        scratch.sh_degree != original.sh_degree) {
      scratch.Resize(original.NumGaussians(), original.sh_degree);
    }
    std::vector<float> sh = ComposeSh(request.regions, request.job, 0,
                                      request.regions.regions.size(), original.sh, scratch);
    on_composed_(std::make_shared<const std::vector<float>>(std::move(sh)), request.generation);
    lock.lock();
  }
}

}  // namespace retint
