// SPDX-License-Identifier: BSD-3-Clause
#include "editing/color_preview.h"

#include <algorithm>
#include <mutex>
#include <new>
#include <span>
#include <utility>

#include "base/parallel.h"
#include "editing/refit_chain.h"

namespace retint {
namespace {

constexpr size_t kArraysKept = 3;   // free ones
constexpr size_t kArraysReady = 2;  // made before they are asked for, unless they are large
constexpr size_t kReadyBytes = size_t{256} << 20;
constexpr int64_t kGaussians = 1024;  // a task

using Indices = std::shared_ptr<const std::vector<int32_t>>;

// body(i, indices[i]) for all of them.
template <typename Body>
void ForEachBlock(const std::vector<int32_t>& indices, const Body& body) {
  ParallelRanges(int64_t(indices.size()), kGaussians, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin); i < size_t(end); ++i) body(i, size_t(indices[i]));
  });
}

}  // namespace

// The Gaussians that some region may change, as a scene of their own: the same regions, their
// shares and fits reduced to these Gaussians.
class ColorPreview::Touched {
 public:
  Touched(const GaussianModel& original, const RegionSet& regions, const RefitJob& job)
      : original_(original),
        num_coeffs_(original.NumShCoeffs()),
        threshold_(job.options.active_threshold) {
    const size_t count = original.NumGaussians(), block = size_t(num_coeffs_) * 3;
    std::vector<uint8_t> touched(count, 0);
    for (const Region& region : regions.regions) {
      const std::vector<float>& shares = region.selection->shares;
      for (size_t g = 0; g < count; ++g) {
        if (shares[g] > threshold_) touched[g] = 1;
      }
      if (!region.fit) continue;
      for (const int32_t g : region.fit->indices) touched[size_t(g)] = 1;
    }
    std::vector<int32_t> slots(count, -1), indices;
    for (size_t g = 0; g < count; ++g) {
      if (!touched[g]) continue;
      slots[g] = int32_t(indices.size());
      indices.push_back(int32_t(g));
    }
    indices_ = std::make_shared<const std::vector<int32_t>>(std::move(indices));
    sh_.resize(indices_->size() * block);
    ForEachBlock(*indices_, [&](size_t i, size_t g) {
      std::copy_n(&original.sh[g * block], block, &sh_[i * block]);
    });
    for (const Region& region : regions.regions) parts_.push_back(Reduce(region, slots));
  }

  const Indices& indices() const { return indices_; }

  bool Fits(const RegionSet& regions, const RefitJob& job) const {
    return job.options.active_threshold == threshold_ &&
           std::equal(parts_.begin(), parts_.end(), regions.regions.begin(), regions.regions.end(),
                      [](const Part& part, const Region& region) {
                        return part.of == region.selection && part.of_fit == region.fit;
                      });
  }

  // These Gaussians after all regions together, [indices, K, 3]; until the next call.
  const FloatArray& Compose(Backend& backend, RegionSet regions, const RefitJob& job) {
    for (size_t i = 0; i < parts_.size(); ++i) {
      regions.regions[i].selection = parts_[i].selection;
      regions.regions[i].fit = parts_[i].fit;
    }
    composed_.resize(sh_.size());
    const size_t block = size_t(num_coeffs_) * 3;
    ForEachBlock(*indices_, [&](size_t i, size_t) {
      std::copy_n(&sh_[i * block], block, &composed_[i * block]);
    });
    composed_ = ComposeSh(backend, regions, job, 0, regions.regions.size(), std::move(composed_),
                          original_, *indices_);
    return composed_;
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
    selection->shares.reserve(indices_->size());
    for (const int32_t g : *indices_) {
      selection->shares.push_back(region.selection->shares[size_t(g)]);
    }
    part.selection = std::move(selection);
    if (region.fit) {
      auto fit = std::make_shared<RegionFit>();
      fit->key = region.fit->key;
      fit->sh = region.fit->sh;
      for (const int32_t g : region.fit->indices) fit->indices.push_back(slots[size_t(g)]);
      part.fit = std::move(fit);
    }
    return part;
  }

  const GaussianModel& original_;
  const int num_coeffs_;
  const double threshold_;
  Indices indices_;           // ascending
  FloatArray sh_, composed_;  // of the original; of the last call
  std::vector<Part> parts_;
};

// Whole sets of coefficients that come back here when nobody shows them any more.
class ColorPreview::Arrays : public std::enable_shared_from_this<Arrays> {
 public:
  struct Array {
    FloatArray sh;
    Indices active;  // differs from the original here
  };

  explicit Arrays(std::shared_ptr<const GaussianModel> original) : original_(std::move(original)) {}

  // Makes one more array if fewer than `count` are free. False if it made none.
  bool MakeReady(size_t count) {
    {
      const std::lock_guard lock(mutex_);
      if (free_.size() >= count) return false;
    }
    if (original_->sh.size() * sizeof(float) > kReadyBytes) return false;
    try {
      Return(Make());
      return true;
    } catch (const std::bad_alloc&) {
      return false;  // nobody has asked for it
    }
  }

  // The original's coefficients with `composed` in place of those of `indices`.
  std::shared_ptr<const Array> Fill(const Indices& indices, const FloatArray& composed) {
    std::unique_ptr<Array> array = Take();
    if (!array) array = Make();
    const size_t block = size_t(original_->NumShCoeffs()) * 3;
    FloatArray& sh = array->sh;
    if (array->active && array->active != indices) {
      ForEachBlock(*array->active, [&](size_t, size_t g) {
        std::copy_n(&original_->sh[g * block], block, &sh[g * block]);
      });
    }
    ForEachBlock(*indices, [&](size_t i, size_t g) {
      std::copy_n(&composed[i * block], block, &sh[g * block]);
    });
    array->active = indices;
    return {array.release(), [pool = shared_from_this()](const Array* done) {
              pool->Return(std::unique_ptr<Array>(const_cast<Array*>(done)));
            }};
  }

 private:
  std::unique_ptr<Array> Make() const {
    auto array = std::make_unique<Array>();
    array->sh = original_->sh;
    return array;
  }

  std::unique_ptr<Array> Take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return nullptr;
    std::unique_ptr<Array> array = std::move(free_.back());
    free_.pop_back();
    return array;
  }

  void Return(std::unique_ptr<Array> array) {
    const std::lock_guard lock(mutex_);
    if (free_.size() < kArraysKept) free_.push_back(std::move(array));
  }

  const std::shared_ptr<const GaussianModel> original_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Array>> free_;
};

ColorPreview::ColorPreview(std::shared_ptr<const GaussianModel> original,
                           std::shared_ptr<Backend> backend)
    : original_(std::move(original)),
      backend_(std::move(backend)),
      arrays_(std::make_shared<Arrays>(original_)) {}

ColorPreview::~ColorPreview() = default;

ColorPreview::Colors ColorPreview::Compose(const RegionSet& regions, const RefitJob& job) {
  if (!touched_ || !touched_->Fits(regions, job)) {
    touched_.reset();
    touched_ = std::make_unique<Touched>(*original_, regions, job);
  }
  const auto array = arrays_->Fill(touched_->indices(), touched_->Compose(*backend_, regions, job));
  return {{array, &array->sh}, array->active};
}

bool ColorPreview::MakeReady() { return arrays_->MakeReady(kArraysReady); }

}  // namespace retint
