// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "recolor/direction_fit.h"
#include "recolor/refit_target.h"
#include "recolor/sh_refitter.h"

namespace retint {
namespace {

constexpr int64_t kPiece = 1 << 18;  // Gaussians on a device at a time: 48 MiB of degree 3

// An edit of Gaussians in a backend's memory, one after the other.
class ShEditor {
 public:
  ShEditor(Backend& backend, int num_coeffs, const ColorEdit& edit, double active_threshold)
      : backend_(backend),
        num_coeffs_(num_coeffs),
        threshold_(active_threshold),
        edit_(backend, CompiledEdit(edit)) {
    if (!edit_.map.program) return;
    const DirectionFit around(num_coeffs);
    basis_ = backend.Upload(around.basis());
    fit_ = backend.Upload(around.fit());
    directions_ = around.directions();
  }
  void Edit(float* sh, const float* shares, int64_t count) {
    backend_.sh().EditSh({.sh = sh,
                          .shares = shares,
                          .threshold = threshold_,
                          .count = count,
                          .k = num_coeffs_,
                          .map = edit_.map,
                          .basis = basis_.data(),
                          .fit = fit_.data(),
                          .directions = directions_});
  }

 private:
  Backend& backend_;
  int num_coeffs_;
  double threshold_;
  UploadedEdit edit_;
  Buffer<float> basis_, fit_;
  int directions_ = 0;
};

// By way of the memory of a device, which sees the Gaussians that change alone.
void EditOnDevice(Backend& backend, std::span<float> sh, size_t block,
                  std::span<const float> shares, double threshold, ShEditor& editor) {
  std::vector<int64_t> active;
  for (size_t g = 0; g < shares.size(); ++g) {
    if (shares[g] > threshold) active.push_back(int64_t(g));
  }
  const bool all = active.size() == shares.size();
  FloatArray piece;
  std::vector<float> of_piece;
  Buffer<float> device_sh, device_shares;
  for (size_t first = 0; first < active.size(); first += kPiece) {
    const size_t count = std::min(active.size() - first, size_t(kPiece));
    const auto at = [&](int64_t i) { return size_t(active[first + size_t(i)]); };
    const auto for_each = [&](const auto& body) {
      ParallelRanges(int64_t(count), 1024, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) body(i);
      });
    };
    float* values = sh.data() + first * block;
    const float* kept = shares.data() + first;
    if (!all) {
      piece.resize(count * block);
      of_piece.resize(count);
      values = piece.data(), kept = of_piece.data();
      for_each([&](int64_t i) {
        std::copy_n(&sh[at(i) * block], block, &piece[size_t(i) * block]);
        of_piece[size_t(i)] = shares[at(i)];
      });
    }
    const size_t bytes = count * block * sizeof(float);
    backend.CopyToDevice(backend.Grow(device_sh, count * block), values, bytes);
    backend.CopyToDevice(backend.Grow(device_shares, count), kept, count * sizeof(float));
    editor.Edit(device_sh.data(), device_shares.data(), int64_t(count));
    backend.CopyToHost(values, device_sh.data(), bytes);
    if (all) continue;
    for_each([&](int64_t i) { std::copy_n(&piece[size_t(i) * block], block, &sh[at(i) * block]); });
  }
}

}  // namespace

void ApplyClosedForm(Backend& backend, std::span<float> sh, int num_coeffs,
                     std::span<const float> shares, const ColorEdit& edit,
                     double active_threshold) {
  const size_t block = size_t(num_coeffs) * 3;
  CheckOption(sh.size() == shares.size() * block,
              "closed form: one share a Gaussian is needed, got " + std::to_string(shares.size()) +
                  " for " + std::to_string(sh.size() / std::max<size_t>(block, 1)));
  ShEditor editor(backend, num_coeffs, edit, active_threshold);
  if (!backend.IsHost()) {
    return EditOnDevice(backend, sh, block, shares, active_threshold, editor);
  }
  editor.Edit(sh.data(), shares.data(), int64_t(shares.size()));
}

namespace {

// Adds each Gaussian's weight in a view, inside its mask and altogether; its geometry.
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
ViewRows TakeShares(Backend& backend, const ViewGeometry& view, double* sums) {
  ViewRows shares;
  shares.gaussians = backend.Download(view.rows(), size_t(view.num_rows()));
  for (const int32_t g : shares.gaussians) {
    for (double* sum = sums + 2 * g; sum < sums + 2 * g + 2; ++sum) {
      shares.values.push_back(float(*sum));
      *sum = 0;
    }
  }
  return shares;
}

}  // namespace

std::vector<float> MaskShares(Renderer& renderer, const std::vector<RefitTarget>& targets,
                              Monitor& monitor) {
  const size_t count = size_t(renderer.model().count());
  Backend& backend = renderer.backend();
  for (const RefitTarget& target : targets) CheckTarget(target);
  ViewReducer reducer = ShareTargets(backend, targets);
  const auto sums = backend.Allocate<double>(2 * count);  // inside, altogether
  std::vector<ViewRows> kept;
  MaskAdder adder(renderer);
  for (size_t v = 0; v < targets.size(); ++v) {
    monitor.Step("shares", double(v), double(targets.size()));
    if (!reducer.Owns(v)) continue;
    const auto geometry = adder.Add(targets[v], sums.data());
    if (reducer.AddsInOrder()) kept.push_back(TakeShares(backend, *geometry, sums.data()));
  }
  monitor.Step("shares", 1, 1);
  auto found = backend.Download(sums.data(), sums.size());
  reducer.SumRows(kept, 2, /*and_square=*/false, &found);
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
  monitor.Step("shares", 1, 1);
  *sums = renderer.backend().Download(on_device.data(), on_device.size());
}

float ShareOf(const double* sums) {
  return sums[1] > 0 ? float(std::clamp(sums[0] / sums[1], 0.0, 1.0)) : 0.0f;
}

}  // namespace retint
