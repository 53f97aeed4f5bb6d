// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/ranks.h"
#include "recolor/direction_fit.h"
#include "recolor/refit_problem.h"
#include "recolor/sh_refitter.h"

namespace retint {
namespace {

constexpr float kY00 = 0.28209479177387814f;  // the constant SH basis function, 1 / (2 sqrt(pi))

// An affine map of colors is one of coefficients, exact in every direction.
void ApplyAffine(const AffineColor& map, float share, size_t coeffs, float* sh) {
  const Eigen::Matrix3f delta = map.gain - Eigen::Matrix3f::Identity();
  // The affine part of delta (0.5 + Y C) + offset that does not depend on the direction.
  const Eigen::Vector3f constant = (0.5f * delta.rowwise().sum() + map.offset) / kY00;
  for (size_t k = 0; k < coeffs; ++k) {
    float* value = sh + 3 * k;
    const Eigen::Vector3f old(value[0], value[1], value[2]);
    Eigen::Vector3f change = delta * old;
    if (k == 0) change += constant;
    for (int c = 0; c < 3; ++c) {
      // Adding 0 would turn -0 into 0: an identity edit changes no bit.
      if (change[c] != 0) value[c] += share * change[c];
    }
  }
}

// Any other map is applied to the colors in directions all around.
void ApplyAround(const DirectionFit& fit, const CompiledEdit& edit, float share, float* sh) {
  DirectionFit::Colors colors = fit.ColorsOf(sh);
  const DirectionFit::Colors shown = colors.cwiseMax(0.0f);
  DirectionFit::Colors edited = shown;
  edit.ApplyToAll({edited.data(), size_t(edited.size())});
  for (Eigen::Index i = 0; i < colors.size(); ++i) {
    const float color = colors.data()[i], old = shown.data()[i];
    colors.data()[i] = DirectionFit::Rise(share * (edited.data()[i] - old), share, color, old);
  }
  const DirectionFit::Colors fitted = fit.FitTo(colors);
  for (Eigen::Index i = 0; i < fitted.size(); ++i) {
    if (fitted.data()[i] != 0) sh[i] += fitted.data()[i];
  }
}

}  // namespace

void ApplyClosedForm(std::span<float> sh, int num_coeffs, std::span<const float> shares,
                     const ColorEdit& edit, double active_threshold) {
  const size_t coeffs = size_t(num_coeffs);
  CheckOption(sh.size() == shares.size() * coeffs * 3,
              "closed form: one share a Gaussian is needed, got " + std::to_string(shares.size()) +
                  " for " + std::to_string(sh.size() / std::max<size_t>(coeffs * 3, 1)));
  const CompiledEdit compiled(edit);
  const DirectionFit fit(num_coeffs);
  ParallelRanges(int64_t(shares.size()), 256, [&](int64_t begin, int64_t end) {
    for (size_t g = size_t(begin); g < size_t(end); ++g) {
      const float share = shares[g];
      if (!(share > active_threshold)) continue;
      if (compiled.IsAffine()) {
        ApplyAffine(compiled.affine(), share, coeffs, &sh[g * coeffs * 3]);
      } else {
        ApplyAround(fit, compiled, share, &sh[g * coeffs * 3]);
      }
    }
  });
}

FloatArray ClosedFormSh(std::span<const float> sh, int num_coeffs, std::span<const float> shares,
                        const ColorEdit& edit, double active_threshold) {
  FloatArray edited;
  ReservePopulated(edited, sh.size());
  edited.assign(sh.begin(), sh.end());
  ApplyClosedForm(edited, num_coeffs, shares, edit, active_threshold);
  return edited;
}

namespace {

// What one view adds to the sums of the Gaussians that it sees; floats, as the blending sums them.
struct ViewShares {
  std::vector<int32_t> gaussians;
  std::vector<float> values;  // [gaussians, 2]
};

// Adds what a view sees of each Gaussian, inside its mask and altogether; its geometry.
class MaskAdder {
 public:
  explicit MaskAdder(Renderer& renderer) : renderer_(renderer) {}
  std::shared_ptr<const ViewGeometry> Add(const RefitTarget& target, double* sums) {
    Backend& backend = renderer_.backend();
    const auto& pixels = target.mask->data;
    backend.Grow(mask_, pixels.size());
    backend.CopyToDevice(mask_.data(), pixels.data(), pixels.size());
    const auto geometry = renderer_.Geometry(target.camera);
    backend.blend().AccumulateShares(*geometry, mask_.data(), sums);
    return geometry;
  }

 private:
  Renderer& renderer_;
  Buffer<uint8_t> mask_;
};

// Moves a view's own sums, all there is in `sums`, out of it.
ViewShares TakeShares(Backend& backend, const ViewGeometry& view, double* sums) {
  ViewShares shares;
  shares.gaussians = backend.Download(view.rows(), size_t(view.num_rows()));
  for (const int32_t g : shares.gaussians) {
    for (double* sum = sums + 2 * g; sum < sums + 2 * g + 2; ++sum) {
      shares.values.push_back(float(*sum));
      *sum = 0;
    }
  }
  return shares;
}

// The sums of all ranks' views: on the CPU in the order of the views.
void AddShares(Ranks& ranks, const std::vector<ViewShares>& kept, std::vector<double>* sums) {
  if (!ranks.AreMany()) return;
  const std::vector<double> own = *sums;  // of a device
  const std::span<std::byte> bytes = BytesOf(std::span(*sums));
  ranks.AddInOrder({&bytes, 1}, [&](size_t) {
    for (size_t i = 0; !ranks.IsRoot() && i < own.size(); ++i) (*sums)[i] += own[i];
    for (const ViewShares& view : kept) {
      for (size_t r = 0; r < view.values.size(); ++r) {
        (*sums)[2 * size_t(view.gaussians[r / 2]) + r % 2] += double(view.values[r]);
      }
    }
  });
}

}  // namespace

std::vector<float> MaskShares(Renderer& renderer, const std::vector<RefitTarget>& targets,
                              Monitor& monitor) {
  const size_t count = size_t(renderer.model().count());
  Backend& backend = renderer.backend();
  Ranks& ranks = CurrentRanks();
  for (const RefitTarget& target : targets) CheckTarget(target);
  const std::vector<int> owners = OwnersOf(targets);
  const auto sums = backend.Allocate<double>(2 * count);  // inside, altogether
  std::vector<ViewShares> kept;
  MaskAdder adder(renderer);
  for (size_t v = 0; v < targets.size(); ++v) {
    monitor.Step("shares", double(v), double(targets.size()));
    if (owners[v] != ranks.rank()) continue;
    const auto geometry = adder.Add(targets[v], sums.data());
    if (ranks.AreMany() && backend.IsHost()) {
      kept.push_back(TakeShares(backend, *geometry, sums.data()));
    }
  }
  auto found = backend.Download(sums.data(), sums.size());
  AddShares(ranks, kept, &found);
  std::vector<float> shares(count);
  for (size_t g = 0; g < count; ++g) shares[g] = ShareOf(&found[2 * g]);
  return shares;
}

void AddMaskSums(Renderer& renderer, const std::vector<RefitTarget>& targets, Monitor& monitor,
                 std::vector<double>* sums) {
  CheckOption(sums->size() == 2 * size_t(renderer.model().count()),
              "sums of shares are not of the renderer's model");
  const auto on_device = renderer.backend().Upload(std::span<const double>(*sums));
  MaskAdder adder(renderer);
  for (size_t v = 0; v < targets.size(); ++v) {
    monitor.Step("shares", double(v), double(targets.size()));
    CheckTarget(targets[v]);
    adder.Add(targets[v], on_device.data());
  }
  *sums = renderer.backend().Download(on_device.data(), on_device.size());
}

float ShareOf(const double* sums) {
  return sums[1] > 0 ? float(std::clamp(sums[0] / sums[1], 0.0, 1.0)) : 0.0f;
}

}  // namespace retint
