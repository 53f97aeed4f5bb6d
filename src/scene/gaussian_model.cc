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

void CheckFinite(const std::vector<float>& values, size_t count, size_t width, const char* field) {
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

}  // namespace

void GaussianModel::Resize(size_t count, int degree) {
  constexpr size_t kLarge = 1 << 16;
  sh_degree = degree;
  const std::pair<std::vector<float>*, size_t> arrays[] = {
      {&sh, static_cast<size_t>(NumShCoeffs()) * 3},
      {&quats_wxyz, 4},
      {&means, 3},
      {&log_scales, 3},
      {&opacity_logits, 1}};
  const auto resize = [&](int64_t i) {
    const auto& [values, width] = arrays[i];
    ResizePopulated(*values, count * width);
  };
  // Side by side where they are large. Few rows are also made inside of loops over threads, where a
  // wait for such tasks would take up another piece of the loop, within that another, and so on.
  if (count >= kLarge) {
    ParallelTasks(std::ssize(arrays), resize);
  } else {
    for (int64_t i = 0; i < std::ssize(arrays); ++i) resize(i);
  }
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
