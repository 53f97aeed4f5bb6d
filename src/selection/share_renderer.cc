// SPDX-License-Identifier: BSD-3-Clause
#include "selection/share_renderer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"

namespace retint {
namespace {

// How wide a mask's soft border may be, as a fraction of the picture's smaller side.
constexpr double kSoftBorder = 0.01;
constexpr int64_t kGrain = 16384;  // Gaussians

// Moves the share of a Gaussian toward the threshold, the more surely it is a floater. A share at
// the threshold moves no pixel across it.
std::vector<float> Votes(const std::vector<float>& shares, const ProjectorOptions& options,
                         const std::vector<float>& floating) {
  constexpr float kRamp = 0.1f;  // floating within kFloating -+ kRamp is partly solid
  const auto neutral = float(options.share_threshold);
  std::vector<float> votes(shares.size());
  ParallelRanges(int64_t(votes.size()), kGrain, [&](int64_t first, int64_t last) {
    for (auto g = size_t(first); g < size_t(last); ++g) {
      const float solid =
          std::clamp(0.5f + (GaussianGraph::kFloating - floating[g]) / (2 * kRamp), 0.0f, 1.0f);
      votes[g] = neutral + solid * (shares[g] - neutral);
    }
  });
  return votes;
}

}  // namespace

ShareRenderer::ShareRenderer(Renderer& renderer, const std::vector<float>& shares,
                             const ProjectorOptions& options, const GaussianGraph* graph)
    : renderer_(renderer), backend_(renderer.backend()) {
  CheckOption(static_cast<int64_t>(shares.size()) == renderer.model().count(),
              "a mask needs one share a Gaussian");
  const bool any_floats = graph && !graph->floating().empty();
  shares_ = backend_.Upload(
      std::span<const float>(any_floats ? Votes(shares, options, graph->floating()) : shares));
  const double half = 0.5 * std::min(options.share_threshold, 1 - options.share_threshold);
  low_ = float(options.share_threshold - half);
  high_ = float(options.share_threshold + half);
  scale_ = 0.5 / half;
  offset_ = 0.5 - scale_ * options.share_threshold;
}

Buffer<uint8_t> ShareRenderer::Render(const PosedCamera& view) {
  const auto geometry = renderer_.Geometry(view);
  const CameraParams& camera = geometry->camera();
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  float* const of_rows = backend_.Grow(features_, size_t(geometry->num_rows()));
  float* const image = backend_.Grow(image_, pixels);
  backend_.blend().GatherRows(*geometry, shares_.data(), 1, of_rows);
  backend_.blend().BlendShares(
      *geometry, {.shares = of_rows, .image = image, .low = low_, .high = high_, .behind = low_});
  auto mask = backend_.Allocate<uint8_t>(pixels);
  backend_.mask().MakeMask({image, camera.width, camera.height, scale_, offset_, 0, mask.data()});
  const double border = kSoftBorder * std::min(camera.width, camera.height);
  backend_.mask().DropFaint({mask.data(), camera.width, camera.height, int(std::ceil(border))});
  return mask;
}

void RenderMasks(Renderer& renderer, const Reconstruction& reconstruction,
                 const std::vector<const View*>& views, const std::vector<float>& shares,
                 const ProjectorOptions& options, const GaussianGraph* graph,
                 const std::function<void()>& step, std::map<std::string, Mask>* masks) {
  constexpr size_t kGroup = 8;
  struct Drawn {
    const View* view;
    Buffer<uint8_t> pixels;
    std::unique_ptr<Arrival> arrival;
  };
  ShareRenderer share_renderer(renderer, shares, options, graph);
  const auto take = [&](std::vector<Drawn>* group) {
    std::vector<Mask> taken(group->size());
    ParallelTasks(int64_t(taken.size()), [&](size_t i) {
      Drawn& drawn = (*group)[i];
      const Camera& camera = reconstruction.Posed(*drawn.view).camera;
      taken[i] =
          Mask::Of(camera.width, camera.height, static_cast<const uint8_t*>(drawn.arrival->Wait()));
      drawn.arrival.reset();
    });
    for (size_t i = 0; i < taken.size(); ++i) {
      (*masks)[(*group)[i].view->name] = std::move(taken[i]);
    }
    group->clear();
  };
  std::vector<Drawn> drawn_before, drawn;
  // Backwards, because the geometry cache holds the last views.
  for (size_t left = views.size(); left > 0;) {
    for (; left > 0 && drawn.size() < kGroup; --left) {
      step();
      const View* const view = views[left - 1];
      auto pixels = share_renderer.Render(reconstruction.Posed(*view));
      auto arrival = renderer.backend().SendToHost(pixels.data(), pixels.size());
      drawn.push_back({view, std::move(pixels), std::move(arrival)});
    }
    take(&drawn_before);
    std::swap(drawn_before, drawn);
  }
  take(&drawn_before);
}

}  // namespace retint
