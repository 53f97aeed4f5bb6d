// SPDX-License-Identifier: BSD-3-Clause
#include "scene/gaussian_model.h"

#include <atomic>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>

#include "base/error.h"
#include "base/finite.h"
#include "base/memory.h"
#include "base/parallel.h"

namespace retint {
namespace {

bool AllFiniteByAllThreads(std::span<const float> values) {
  constexpr int64_t kPiece = int64_t{1} << 18;
  std::atomic<bool> finite = true;
  ParallelRanges(std::ssize(values), kPiece, [&](int64_t begin, int64_t end) {
    const auto piece = values.subspan(static_cast<size_t>(begin), static_cast<size_t>(end - begin));
    if (!AllFinite(piece)) finite.store(false, std::memory_order_relaxed);
  });
  return finite;
}

void CheckFinite(std::span<const float> values, size_t count, size_t width, const char* field) {
  if (values.size() != count * width) {
    throw InputError(std::string("Gaussians: ") + field + " has " + std::to_string(values.size()) +
                     " values, expected " + std::to_string(count * width));
  }
  if (AllFiniteByAllThreads(values)) return;
  for (size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      throw InputError("Gaussian " + std::to_string(i / width) + ": " + field +
                       (std::isnan(values[i]) ? " is NaN" : " is infinite"));
    }
  }
}

// resize(array, size) for each array of `count` Gaussians.
template <typename Resize>
void ForEachArray(GaussianModel& model, size_t count, const Resize& resize) {
  constexpr size_t kLarge = 1 << 16;
  const std::pair<FloatArray*, size_t> arrays[] = {
      {&model.sh, static_cast<size_t>(model.NumShCoeffs()) * 3},
      {&model.quats_wxyz, 4},
      {&model.means, 3},
      {&model.log_scales, 3},
      {&model.opacity_logits, 1}};
  const auto task = [&](int64_t i) {
    const auto& [values, width] = arrays[i];
    ReservePopulated(*values, count * width);
    resize(*values, count * width);
  };
  // Side by side where they are large. Few rows are also made inside of loops over threads, where a
  // wait for such tasks would take up another piece of the loop, within that another, and so on.
  if (count >= kLarge) {
    ParallelTasks(std::ssize(arrays), task);
  } else {
    for (int64_t i = 0; i < std::ssize(arrays); ++i) task(i);
  }
}

}  // namespace

void GaussianModel::Resize(size_t count, int degree) {
  sh_degree = degree;
  ForEachArray(*this, count, [](FloatArray& values, size_t size) { values.resize(size, 0); });
}

void GaussianModel::ResizeUnset(size_t count, int degree) {
  sh_degree = degree;
  ForEachArray(*this, count, [](FloatArray& values, size_t size) { values.resize(size); });
}

void GaussianModel::Validate() const {
  const size_t count = NumGaussians();
  CheckFinite(means, count, 3, "mean");
  CheckFinite(quats_wxyz, count, 4, "rotation");
  CheckFinite(log_scales, count, 3, "scale");
  CheckFinite(opacity_logits, count, 1, "opacity");
  CheckFinite(sh, count, static_cast<size_t>(NumShCoeffs()) * 3, "spherical harmonics");
}

}  // namespace retint
