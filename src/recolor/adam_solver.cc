// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/adam_solver.h"

#include <algorithm>

#include "recolor/adam_boxes.h"

namespace retint {
namespace {

constexpr int kLossInterval = 50;
constexpr float kBeta1 = 0.9f, kBeta2 = 0.999f, kEpsilon = 1e-15f;

}  // namespace

void AdamOptions::Describe(OptionList& list) {
  list.push_back({.name = "iterations",
                  .member = &iterations,
                  .range = OptionRange::AtLeast(0),
                  .help = "steps; 0: until it is stopped, 3000 on the command line",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "closed_form_start",
                  .member = &closed_form_start,
                  .help = "begin at the closed form, not at the original coefficients",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "learning_rate",
                  .member = &learning_rate,
                  .range = OptionRange::Above(0),
                  .help = "step size",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "lambda_dssim",
                  .member = &lambda_dssim,
                  .range = OptionRange::Closed(0, 1),
                  .help = "weight of D-SSIM in the loss; L1 has the rest",
                  .title = "Weight of structure",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "seed", .member = &seed, .help = "of the order of the views"});
}

void AdamOptions::Check() const { CheckRanges(*this); }

AdamSolver::AdamSolver(RefitViews& views, const AdamOptions& options)
    : RefitSolver(views), options_(options), random_(options.seed) {
  Backend& backend = views_.backend();
  values_ = backend.Upload(options.closed_form_start ? views_.start() : views_.original());
  for (auto* buffer : {&gradient_, &m_, &v_}) {
    *buffer = backend.Allocate<float>(views_.NumValues());
  }
  recent_loss_ = backend.Allocate<double>(1);
}

// Every view once a round, in a random order, as 3DGS trains.
size_t AdamSolver::NextView() {
  if (deck_.empty()) {
    deck_.resize(views_.NumViews());
    for (size_t v = 0; v < deck_.size(); ++v) deck_[v] = v;
  }
  // The modulo's bias is below 1e-15; std distributions differ between standard libraries.
  const size_t pick = size_t(random_() % deck_.size());
  const size_t view = deck_[pick];
  deck_[pick] = deck_.back();
  deck_.pop_back();
  return view;
}

void AdamSolver::Evaluate(size_t index) {
  if (views_.reducer().Owns(views_.TargetOf(index))) EvaluateOwn(index);
  if (views_.reducer().IsShared()) Share(index);
}

// The owner's gradient and loss to all processes.
void AdamSolver::Share(size_t index) {
  Backend& backend = views_.backend();
  ViewReducer& reducer = views_.reducer();
  const size_t target = views_.TargetOf(index);
  double loss = 0;
  if (reducer.Owns(target)) {
    loss = backend.Download(recent_loss_.data(), 1)[0];
    backend.Fill(recent_loss_.data(), 0, sizeof(double));
  }
  reducer.Broadcast(target, BytesOf(std::span(&loss, 1)));
  shared_loss_ += loss;
  reducer.Broadcast(target, gradient_);
}

void AdamSolver::EvaluateOwn(size_t index) {
  Backend& backend = views_.backend();
  const auto view = views_.Visit<AdamView>(index);
  const CameraParams& camera = view->region->camera();
  RefitScratch& scratch = views_.scratch();
  float* colors = scratch.features[0].data();
  float* change = scratch.features[1].data();
  float* image = scratch.images[0].data();
  float* target = scratch.images[1].data();
  float* delta = scratch.images[2].data();

  const auto& [x0, y0, x1, y1] = view->box;
  PackBoxParams box{.image = image,
                    .width = camera.width,
                    .height = camera.height,
                    .box = {x0, y0, x1, y1},
                    .packed = view->render.data(),
                    .unit = AdamBoxes::kUnit};
  backend.refit().UnpackBox(box);
  box.image = target;
  if (!view->photo.empty()) box.packed = view->photo.data();
  backend.refit().UnpackBox(box);
  backend.refit().EditImage({.image = target,
                             .mask = view->mask.data(),
                             .map = view->map,
                             .width = camera.width,
                             .height = camera.height,
                             .box = {x0, y0, x1, y1},
                             .out = target});

  views_.BlendChange(*view, values_.data(), colors, change, delta);
  backend.refit().RegionAdd(*view->region, image, delta);

  const auto& roi = view->roi;
  backend.refit().ImageLoss({.image = image,
                             .target = target,
                             .width = camera.width,
                             .height = camera.height,
                             .lambda = float(options_.lambda_dssim),
                             .roi = {roi[0], roi[1], roi[2], roi[3]},
                             .gradient = delta,
                             .loss = recent_loss_.data()});
  backend.Fill(gradient_.data(), 0, views_.NumValues() * sizeof(float));
  backend.blend().BlendTranspose(*view->region,
                                 {.residual = delta, .channels = 3, .result = change});
  const float* const center = camera.center;
  backend.sh().EvalShTranspose(views_.model(), {.rows = view->region->rows(),
                                                .slots = view->slots.data(),
                                                .count = view->region->num_rows(),
                                                .color_gradients = change,
                                                .colors = colors,
                                                .center = {center[0], center[1], center[2]},
                                                .gradient = gradient_.data()});
}

double AdamSolver::RecentLoss() {
  if (views_.reducer().IsShared()) return shared_loss_;
  return views_.backend().Download(recent_loss_.data(), 1)[0];
}

bool AdamSolver::Iterate(Monitor& monitor) {
  const int limit = options_.iterations;
  // Without a limit the share done grows towards 1 and never reaches it.
  monitor.Step("refit", double(iterations_), double(limit > 0 ? limit : iterations_ + 1));
  Evaluate(NextView());
  ++iterations_;
  views_.backend().solve().Adam({.values = values_.data(),
                                 .gradients = gradient_.data(),
                                 .m = m_.data(),
                                 .v = v_.data(),
                                 .count = int64_t(views_.NumValues()),
                                 .step = iterations_,
                                 .learning_rate = float(options_.learning_rate),
                                 .beta1 = kBeta1,
                                 .beta2 = kBeta2,
                                 .epsilon = kEpsilon});
  const int in_interval = (iterations_ - 1) % kLossInterval + 1;
  if (in_interval == kLossInterval || iterations_ == limit) {
    Backend& backend = views_.backend();
    losses_.push_back(RecentLoss() / in_interval);
    backend.Fill(recent_loss_.data(), 0, sizeof(double));
    shared_loss_ = 0;
  }
  return limit == 0 || iterations_ < limit || Finish(false, "all steps done");
}

}  // namespace retint
