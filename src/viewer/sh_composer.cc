// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/sh_composer.h"

#include <algorithm>
#include <new>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "session/refit_chain.h"
#include "viewer/failure_text.h"

namespace retint {
namespace {

constexpr size_t kBuffersKept = 3;   // free ones
constexpr size_t kBuffersReady = 2;  // made before they are asked for, unless they are large
constexpr size_t kReadyBytes = size_t{256} << 20;
constexpr int64_t kGaussians = 1024;  // a task

// The blocks of these Gaussians in `from`, to the same place in `to`.
void CopyBlocks(const std::vector<int32_t>& indices, size_t block, std::span<const float> from,
                std::span<float> to) {
  ParallelRanges(static_cast<int64_t>(indices.size()), kGaussians, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const size_t at = static_cast<size_t>(indices[i]) * block;
      std::copy_n(from.data() + at, block, to.data() + at);
    }
  });
}

}  // namespace

// The Gaussians that some region may change, as a scene of their own: the same regions, their
// shares and fits reduced to these Gaussians.
class ShComposer::Touched {
 public:
  explicit Touched(const Request& request) : original_(request.original) {
    const size_t count = original_->NumGaussians();
    threshold_ = request.job.options.active_threshold;
    std::vector<uint8_t> touched(count, 0);
    for (const Region& region : request.regions.regions) {
      const std::vector<float>& shares = region.selection->shares;
      for (size_t g = 0; g < count; ++g) {
        if (shares[g] > threshold_) touched[g] = 1;
      }
      if (!region.fit) continue;
      for (const int32_t g : region.fit->indices) touched[static_cast<size_t>(g)] = 1;
    }
    std::vector<int32_t> slots(count, -1);
    for (size_t g = 0; g < count; ++g) {
      if (!touched[g]) continue;
      slots[g] = static_cast<int32_t>(indices_.size());
      indices_.push_back(static_cast<int32_t>(g));
    }
    const size_t block = static_cast<size_t>(original_->NumShCoeffs()) * 3;
    sh_.resize(indices_.size() * block);
    for (size_t i = 0; i < indices_.size(); ++i) {
      std::copy_n(original_->sh.data() + static_cast<size_t>(indices_[i]) * block, block,
                  sh_.data() + i * block);
    }
    for (const Region& region : request.regions.regions) parts_.push_back(Reduce(region, slots));
  }

  bool Fits(const Request& request) const {
    return request.original == original_ && request.job.options.active_threshold == threshold_ &&
           std::equal(parts_.begin(), parts_.end(), request.regions.regions.begin(),
                      request.regions.regions.end(), [](const Part& part, const Region& region) {
                        return part.of == region.selection && part.of_fit == region.fit;
                      });
  }

  // What all regions together make of these Gaussians.
  RegionFit Compose(const Request& request) {
    RegionSet regions = request.regions;
    for (size_t i = 0; i < parts_.size(); ++i) {
      regions.regions[i].selection = parts_[i].selection;
      regions.regions[i].fit = parts_[i].fit;
    }
    RegionFit composed;
    composed.indices = indices_;
    composed.sh = ComposeSh(regions, request.job, 0, regions.regions.size(), sh_,
                            original_->NumShCoeffs(), indices_);
    return composed;
  }

 private:
  struct Part {
    std::shared_ptr<const RegionSelection> of, selection;
    std::shared_ptr<const RegionFit> of_fit, fit;
  };

  // Ids and keys stay: they say whether a fit is up to date.
  Part Reduce(const Region& region, const std::vector<int32_t>& slots) const {
    Part part{region.selection, nullptr, region.fit, nullptr};
    auto selection = std::make_shared<RegionSelection>();
    selection->id = region.selection->id;
    selection->shares.reserve(indices_.size());
    for (const int32_t g : indices_) {
      selection->shares.push_back(region.selection->shares[static_cast<size_t>(g)]);
    }
    part.selection = std::move(selection);
    if (region.fit) {
      auto fit = std::make_shared<RegionFit>();
      fit->key = region.fit->key;
      fit->sh = region.fit->sh;
      for (const int32_t g : region.fit->indices) {
        fit->indices.push_back(slots[static_cast<size_t>(g)]);
      }
      part.fit = std::move(fit);
    }
    return part;
  }

  std::shared_ptr<const GaussianModel> original_;
  double threshold_ = 0;
  std::vector<int32_t> indices_;  // ascending
  FloatArray sh_;                 // of the original
  std::vector<Part> parts_;
};

// Whole sets of coefficients that come back here when nobody shows them any more.
class ShComposer::Buffers : public std::enable_shared_from_this<Buffers> {
 public:
  struct Buffer {
    FloatArray sh;
    std::vector<int32_t> active;  // differs from the original here
  };

  explicit Buffers(std::shared_ptr<const GaussianModel> original)
      : original_(std::move(original)) {}
  const std::shared_ptr<const GaussianModel>& original() const { return original_; }

  // One more free one, where there are fewer than `count`; false: there are enough.
  bool MakeReady(size_t count) {
    {
      const std::lock_guard lock(mutex_);
      if (free_.size() >= count) return false;
    }
    if (original_->sh.size() * sizeof(float) > kReadyBytes) return false;
    try {
      auto buffer = std::make_unique<Buffer>();
      buffer->sh = original_->sh;
      Return(std::move(buffer));
      return true;
    } catch (const std::bad_alloc&) {
      return false;  // nobody has asked for it
    }
  }

  // The original's coefficients with those of `composed` in their place.
  std::shared_ptr<const Buffer> Fill(RegionFit composed) {
    const int num_coeffs = original_->NumShCoeffs();
    std::unique_ptr<Buffer> buffer = Take();
    if (buffer) {
      CopyBlocks(buffer->active, static_cast<size_t>(num_coeffs) * 3, original_->sh, buffer->sh);
    } else {
      buffer = std::make_unique<Buffer>();
      buffer->sh = original_->sh;
    }
    composed.Apply(buffer->sh, num_coeffs);
    buffer->active = std::move(composed.indices);
    return {buffer.release(), [pool = shared_from_this()](const Buffer* done) {
              pool->Return(std::unique_ptr<Buffer>(const_cast<Buffer*>(done)));
            }};
  }

 private:
  std::unique_ptr<Buffer> Take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return nullptr;
    std::unique_ptr<Buffer> buffer = std::move(free_.back());
    free_.pop_back();
    return buffer;
  }

  void Return(std::unique_ptr<Buffer> buffer) {
    const std::lock_guard lock(mutex_);
    if (free_.size() < kBuffersKept) free_.push_back(std::move(buffer));
  }

  const std::shared_ptr<const GaussianModel> original_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Buffer>> free_;
};

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

ShComposer::Result ShComposer::Work(const Request& request) {
  if (!touched_ || !touched_->Fits(request)) touched_ = std::make_unique<Touched>(request);
  if (!buffers_ || buffers_->original() != request.original) {
    buffers_ = std::make_shared<Buffers>(request.original);
  }
  const auto buffer = buffers_->Fill(touched_->Compose(request));
  return {{buffer, &buffer->sh}, {buffer, &buffer->active}, request.generation, {}};
}

void ShComposer::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    // Before the next change comes: it may be a color that is being dragged.
    while (buffers_ && !quit_ && !drop_ && !pending_) {
      lock.unlock();
      const bool made = buffers_->MakeReady(kBuffersReady);
      lock.lock();
      if (!made) break;
    }
    changed_.wait(lock, [this] { return quit_ || drop_ || pending_; });
    if (quit_) return;
    if (std::exchange(drop_, false)) {
      touched_.reset();
      buffers_.reset();
    }
    if (!pending_) continue;
    const Request request = std::move(*pending_);
    pending_.reset();
    lock.unlock();
    Result result;
    try {
      result = Work(request);
    } catch (const std::exception& failure) {
      result.failure = FailureText(failure).toStdString();
      touched_.reset();
      buffers_.reset();
    }
    on_composed_(result);
    lock.lock();
  }
}

}  // namespace retint
