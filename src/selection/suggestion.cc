// SPDX-License-Identifier: BSD-3-Clause
#include "selection/suggestion.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

#include "base/error.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "suggestion";
constexpr double kKnownFraction = 0.5;  // of the visibility from which on a Gaussian is settled
constexpr double kLeastDoubt = 0.01;    // pixels; what is less is left out

// A Gaussian that is not certain.
struct Doubt {
  size_t gaussian = 0;
  double visible = 0, doubt = 0;  // pixels; in [0, 1]
};

// A group, and the pixels of its views in which each doubtful Gaussian shows.
struct Candidate {
  std::string name;
  std::vector<float> sees;  // [doubts]
};

// W^T 1 of one view, of every Gaussian.
class VisibilityLifter {
 public:
  explicit VisibilityLifter(Renderer& renderer) : renderer_(renderer) {}

  std::vector<float> Lift(const PosedCamera& posed) {
    Backend& backend = renderer_.backend();
    const auto geometry = renderer_.Geometry(posed);
    const size_t pixels = size_t(posed.camera.width) * size_t(posed.camera.height);
    if (ones_.size() < pixels) {
      ones_ = backend.Upload(std::span<const float>(std::vector<float>(pixels, 1.0f)));
    }
    const auto rows = backend.Allocate<float>(size_t(geometry->num_rows()));
    BlendTransposeParams lift{};
    lift.residual = ones_.data();
    lift.channels = 1;
    lift.result = rows.data();
    backend.blend().BlendTranspose(*geometry, lift);
    const std::vector<float> none(size_t(renderer_.model().count()), 0.0f);
    const auto sums = backend.Upload(std::span<const float>(none));
    backend.blend().AddRows(*geometry, rows.data(), 1, sums.data());
    return backend.Download(sums.data(), sums.size());
  }

 private:
  Renderer& renderer_;
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

std::vector<ViewSuggestion> SuggestViews(Renderer& renderer, const Reconstruction& reconstruction,
                                         const std::vector<ViewGroup>& groups,
                                         const std::vector<std::string>& painted,
                                         std::span<const float> confidence,
                                         std::span<const float> visible, int count,
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
  VisibilityLifter lifter(renderer);
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

}  // namespace retint
