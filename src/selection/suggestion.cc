// SPDX-License-Identifier: BSD-3-Clause
#include "selection/suggestion.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "selection/paint_advice.h"
#include "selection/shrunk_view.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "suggestion";
constexpr double kKnownFraction = 0.5;  // of the visibility; from here on, a Gaussian is settled
constexpr double kLeastDoubt = 0.01;    // pixels; smaller doubts are ignored

// An uncertain Gaussian.
struct Doubt {
  size_t gaussian = 0;
  double visible = 0, doubt = 0;  // pixels; in [0, 1]
};

// A group, and the visible pixels of each uncertain Gaussian in its views.
struct Candidate {
  std::string name;
  std::vector<float> sees;  // [doubts]
};

// W^T 1 of one view for every Gaussian.
class VisibilityLifter {
 public:
  VisibilityLifter(Renderer& renderer, bool draws_small)
      : renderer_(renderer), draws_small_(draws_small) {}

  // In pixels of the full view, even if it is drawn small.
  std::vector<float> Lift(const PosedCamera& view) {
    const bool small = draws_small_ && !renderer_.HasGeometry(view);
    const PosedCamera posed = small ? Shrunk(view) : view;
    std::vector<float> lifted = LiftDrawn(posed, /*cache=*/!small);
    const double each = NumPixels(view.camera) / NumPixels(posed.camera);
    if (small) {
      for (float& value : lifted) value *= float(each);
    }
    return lifted;
  }

 private:
  static double NumPixels(const Camera& camera) { return double(camera.width) * camera.height; }

  std::vector<float> LiftDrawn(const PosedCamera& posed, bool cache) {
    Backend& backend = renderer_.backend();
    const auto geometry = renderer_.Geometry(posed, cache);
    const size_t pixels = size_t(posed.camera.width) * size_t(posed.camera.height);
    if (ones_.size() < pixels) {
      ones_ = backend.Upload(std::span<const float>(std::vector<float>(pixels, 1.0f)));
    }
    const auto rows = backend.Allocate<float>(size_t(geometry->num_rows()));
    backend.blend().BlendTranspose(
        *geometry, {.residual = ones_.data(), .channels = 1, .result = rows.data()});
    const std::vector<float> none(size_t(renderer_.model().count()), 0.0f);
    const auto sums = backend.Upload(std::span<const float>(none));
    backend.blend().AddRows(*geometry, rows.data(), 1, sums.data());
    return backend.Download(sums.data(), sums.size());
  }

  Renderer& renderer_;
  bool draws_small_;
  Buffer<float> ones_;
};

double Settles(const std::vector<Doubt>& doubts, const Candidate& candidate) {
  double sum = 0;
  for (size_t i = 0; i < doubts.size(); ++i) {
    sum += doubts[i].doubt * std::min(doubts[i].visible, candidate.sees[i] / kKnownFraction);
  }
  return sum;
}

void Paint(const Candidate& candidate, std::vector<Doubt>* doubts) {
  for (size_t i = 0; i < doubts->size(); ++i) {
    Doubt& one = (*doubts)[i];
    one.doubt *= 1 - std::min(1.0, candidate.sees[i] / (kKnownFraction * one.visible));
  }
}

}  // namespace

bool SettlesAnything(std::span<const ViewSuggestion> suggestions) {
  return std::any_of(suggestions.begin(), suggestions.end(),
                     [](const ViewSuggestion& one) { return one.settles > 0; });
}

namespace {

std::vector<ViewSuggestion> Suggest(Renderer& renderer, const Reconstruction& reconstruction,
                                    const std::vector<ViewGroup>& groups,
                                    const std::vector<std::string>& painted,
                                    std::span<const float> confidence,
                                    std::span<const float> visible, int count, bool draws_small,
                                    Monitor& monitor) {
  const auto gaussians = size_t(renderer.model().count());
  CheckOption(confidence.size() == gaussians && visible.size() == gaussians,
              "a suggestion needs the confidence and the visibility of every Gaussian");
  std::vector<Doubt> doubts;
  double all = 0;
  for (size_t g = 0; g < gaussians; ++g) {
    const double doubt = 1 - double(confidence[g]);
    if (!(doubt * visible[g] > kLeastDoubt)) continue;
    doubts.push_back({g, visible[g], doubt});
    all += doubt * visible[g];
  }
  VisibilityLifter lifter(renderer, draws_small);
  std::vector<Candidate> candidates;
  double done = 0, views = 0;
  for (const ViewGroup& group : groups) views += double(group.views.size());
  const auto is_painted = [&](const std::string& name) {
    return std::find(painted.begin(), painted.end(), name) != painted.end();
  };
  for (const ViewGroup& group : groups) {
    if (is_painted(group.name) ||
        std::any_of(group.views.begin(), group.views.end(),
                    [&](const View* view) { return is_painted(view->name); })) {
      monitor.Step(kStage, done, views);
      done += double(group.views.size());
      continue;
    }
    Candidate candidate{group.name, std::vector<float>(doubts.size(), 0.0f)};
    for (const View* const view : group.views) {
      monitor.Step(kStage, done++, views);
      const std::vector<float> lifted = lifter.Lift(reconstruction.Posed(*view));
      for (size_t i = 0; i < doubts.size(); ++i) candidate.sees[i] += lifted[doubts[i].gaussian];
    }
    candidates.push_back(std::move(candidate));
  }
  monitor.Step(kStage, 1, 1);

  std::vector<ViewSuggestion> alone, result;
  for (const Candidate& one : candidates) alone.push_back({one.name, Settles(doubts, one), 0});
  std::vector<uint8_t> taken(candidates.size(), 0);
  for (int rank = 0; rank < count && result.size() < candidates.size(); ++rank) {
    size_t best = candidates.size();
    double most = -1;
    for (size_t i = 0; i < candidates.size(); ++i) {
      const double settles = taken[i] ? -1 : Settles(doubts, candidates[i]);
      if (settles > most) most = settles, best = i;
    }
    taken[best] = 1;
    result.push_back({candidates[best].name, most, 0});
    Paint(candidates[best], &doubts);
  }
  std::vector<size_t> rest;
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (!taken[i]) rest.push_back(i);
  }
  std::stable_sort(rest.begin(), rest.end(),
                   [&](size_t a, size_t b) { return alone[a].settles > alone[b].settles; });
  for (const size_t i : rest) result.push_back(alone[i]);
  for (ViewSuggestion& one : result) one.fraction = all > 0 ? one.settles / all : 0;
  return result;
}

// At most `most` groups, spread evenly.
std::vector<ViewGroup> Some(const std::vector<ViewGroup>& groups, size_t most) {
  if (groups.size() <= most) return groups;
  std::vector<ViewGroup> some;
  for (size_t i = 0; i < most; ++i)
    some.push_back(groups[(2 * i + 1) * groups.size() / (2 * most)]);
  return some;
}

}  // namespace

std::vector<ViewSuggestion> SuggestViews(Renderer& renderer, const Reconstruction& reconstruction,
                                         const std::vector<ViewGroup>& groups,
                                         const std::vector<std::string>& painted,
                                         std::span<const float> confidence,
                                         std::span<const float> visible, int count,
                                         Monitor& monitor) {
  return Suggest(renderer, reconstruction, groups, painted, confidence, visible, count,
                 /*draws_small=*/false, monitor);
}

std::optional<PaintAdvice> AdvisePaint(Renderer& renderer, const Reconstruction& reconstruction,
                                       const std::vector<ViewGroup>& groups,
                                       const std::vector<std::string>& painted,
                                       std::span<const float> shares,
                                       std::span<const float> confidence,
                                       std::span<const float> visible, Monitor& monitor) {
  constexpr float kTouches = 0.05F;  // RefitOptions::active_threshold
  constexpr float kUndecided = 0.5F;
  constexpr double kLeast = 0.05;  // of the Gaussians that touch the selection
  constexpr size_t kMostGroups = 12;
  std::vector<float> sure(confidence.begin(), confidence.end());
  double touched = 0, uncertain = 0;
  for (size_t g = 0; g < sure.size(); ++g) {
    if (shares[g] > kTouches || sure[g] < kUndecided) {
      touched += visible[g];
      uncertain += (1 - double(sure[g])) * visible[g];
    } else {
      sure[g] = 1;
    }
  }
  if (!(uncertain > kLeast * touched)) return std::nullopt;
  std::vector<ViewGroup> open;
  std::ranges::copy_if(groups, std::back_inserter(open), [&](const ViewGroup& group) {
    return std::ranges::find(painted, group.name) == painted.end();
  });
  const auto best = Suggest(renderer, reconstruction, Some(open, kMostGroups), painted, sure,
                            visible, 1, /*draws_small=*/true, monitor);
  if (best.empty() || best.front().fraction * uncertain < kLeast * touched) return std::nullopt;
  return PaintAdvice{best.front().view, uncertain / touched, best.front().fraction};
}

}  // namespace retint
