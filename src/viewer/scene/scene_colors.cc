// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/scene_colors.h"

#include <utility>

#include "viewer/scene/post.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/scene/sh_composer.h"

namespace retint {
namespace {

using OptimizerState = BackgroundOptimizer::State;

constexpr int kPollMs = 40;      // of the optimizer's snapshots
constexpr int kRestartMs = 300;  // without edits, before the optimizer starts

bool NeedsFit(const RegionSet& regions, const RefitJob& job) {
  for (size_t i = 0; i < regions.regions.size(); ++i) {
    const Region& region = regions.regions[i];
    if (!region.visible || ChangesNothing(region.EffectiveEdit())) continue;
    if (!region.fit || region.fit->key != regions.FitKey(i, job)) return true;
  }
  return false;
}

}  // namespace

SceneColors::SceneColors(SceneController* scene) : QObject(scene), scene_(*scene) {
  poll_.setInterval(kPollMs);
  connect(&poll_, &QTimer::timeout, this, &SceneColors::PollOptimizer);
  restart_.setSingleShot(true);
  restart_.setInterval(kRestartMs);
  connect(&restart_, &QTimer::timeout, this, &SceneColors::StartRefit);
  composer_ = std::make_unique<ShComposer>([this](const ShComposer::Result& result) {
    Post(this, [this, result] {
      const ShPointer& sh = result.colors.sh;
      if (session_ && !sh)
        Q_EMIT scene_.failed(tr("Recoloring"), QString::fromStdString(result.failure));
      if (!sh) return;
      // An older result is still closer to the edit than the shown colors, unless the optimizer was
      // faster.
      if (!session_ || sh->size() != original_->size()) return;
      const bool overtaken = refit_generation_ == generation_ && snapshot_ && scene_.solo() == 0 &&
                             optimizer_.Active();
      if (overtaken) return;
      if (shown_key_.empty()) return SetSh(original_);
      SetSh(sh, result.colors.active);
    });
  });
}

SceneColors::~SceneColors() {
  composer_.reset();
  if (session_) session_->refits().optimizer().Cancel();
}

void SceneColors::Begin(std::shared_ptr<EditSession> session) {
  session_ = std::move(session);
  const auto facts = scene_.facts();
  original_ = {facts->original, &facts->original->sh};
  sh_ = original_;
  sh_active_.reset();
  ++sh_version_;
  started_job_ = job_ = session_->store().job();
}

void SceneColors::End() {
  restart_.stop();
  poll_.stop();
  if (session_) session_->refits().optimizer().Cancel();
  composer_->Drop();
  session_.reset();
  original_.reset();
  sh_.reset();
  sh_active_.reset();
  shown_key_.clear();
  snapshot_.reset();
  optimizer_ = {};
  ++generation_;
}

RegionSet SceneColors::Shown() const {
  RegionSet shown = scene_.regions();
  if (scene_.solo() != 0) {
    for (Region& region : shown.regions) region.visible = region.id == scene_.solo();
  }
  return shown;
}

// The key of a fit for all shown regions; empty if none is shown.
std::string SceneColors::KeyOfShown() const {
  const RegionSet shown = Shown();
  for (size_t i = shown.regions.size(); i-- > 0;) {
    if (shown.regions[i].visible) return shown.FitKey(i, started_job_);
  }
  return {};
}

// If the shown colors change, composes them again, and makes the optimizer follow.
void SceneColors::Refresh() {
  const std::string key = KeyOfShown();
  if (key == shown_key_) return;
  shown_key_ = key;
  ++generation_;
  Compose();
  if (scene_.solo() != 0) return;
  // The current fit is out of date, and the picture needs its cores.
  if (optimizer_.Active()) CancelRefit();
  if (automatic_ && NeedsFit(scene_.regions(), job_)) restart_.start();
}

void SceneColors::Compose() {
  const auto facts = scene_.facts();
  if (!facts) return;
  if (shown_key_.empty()) return SetSh(original_);
  const RegionSet shown = Shown();
  for (const Region& region : shown.regions) {
    // The worker is measuring it. Until then, the colors do not change.
    if (region.visible && region.edit.NeedsMainColor()) return;
  }
  composer_->Compose({facts->original, facts->backend, shown, started_job_, generation_});
}

void SceneColors::SetSh(ShPointer sh, ActivePointer active) {
  if (sh == sh_) return;
  sh_ = std::move(sh);
  sh_active_ = std::move(active);
  ++sh_version_;
  Q_EMIT shChanged();
}

// ---- Background optimizer

void SceneColors::SetRefitJob(const RefitJob& job) {
  job.options.Check();
  job_ = job;
  Q_EMIT refitJobChanged();
}

void SceneColors::SetAutomaticRefit(bool automatic) {
  if (automatic == automatic_) return;
  automatic_ = automatic;
  if (!automatic) restart_.stop();
  Q_EMIT optimizerChanged();
}

void SceneColors::StartRefit() {
  restart_.stop();
  if (!session_) return;
  const uint64_t generation = generation_;
  const RefitJob job = job_;
  scene_.Ask(
      job.target == TargetKind::kPhoto ? tr("Reading photos") : QString(),
      [=](EditSession& session, Monitor& monitor) {
        session.refits().CollectFits();
        return session.refits().Start(job, monitor);
      },
      [=, this](uint64_t number) {
        started_job_ = job;
        shown_key_ = KeyOfShown();
        refit_generation_ = generation;
        refit_number_ = number;
        optimizer_ = {};
        optimizer_.state = OptimizerState::kRunning;
        if (generation != generation_) {
          // The edit has changed while the job was waiting.
          session_->refits().optimizer().Cancel();
          if (automatic_) restart_.start();
        }
        poll_.start();
        Q_EMIT optimizerChanged();
      });
}

void SceneColors::PauseRefit() {
  if (!session_) return;
  session_->refits().optimizer().Pause();
  PollOptimizer();
}

void SceneColors::ResumeRefit() {
  if (!session_) return;
  session_->refits().optimizer().Resume();
  PollOptimizer();
}

void SceneColors::CancelRefit() {
  restart_.stop();
  if (!session_) return;
  session_->refits().optimizer().Cancel();
  PollOptimizer();
}

void SceneColors::PollOptimizer() {
  if (!session_) return;
  const OptimizerStatus old = optimizer_;
  optimizer_.state = session_->refits().optimizer().state();
  if (old.state == OptimizerState::kRunning) optimizer_.seconds += poll_.interval() / 1000.0;
  const auto newest = session_->refits().NewestSnapshot();
  const bool news = newest && newest != snapshot_ && newest->job == refit_number_;
  if (news) {
    snapshot_ = newest;
    optimizer_.steps = newest->steps;
    optimizer_.region = newest->region;
    if (newest->region != 0) {
      optimizer_.losses = newest->losses;
    } else if (!newest->fits.empty()) {  // all done; a quick fit may have been missed
      optimizer_.losses = newest->fits.rbegin()->second->summary.losses;
    }
    if (refit_generation_ == generation_ && scene_.solo() == 0 && !shown_key_.empty())
      SetSh(newest->sh);
  }
  if (!optimizer_.Active()) {
    poll_.stop();
    if (optimizer_.state == OptimizerState::kFinished && old.Active()) {
      scene_.Run({}, [](EditSession& session, Monitor&) { session.refits().CollectFits(); });
    }
    if (optimizer_.state == OptimizerState::kFailed && old.Active()) {
      optimizer_.error = session_->refits().optimizer().error();
      Q_EMIT scene_.failed(tr("Refit"), QString::fromStdString(optimizer_.error));
    }
  }
  if (news || old.state != optimizer_.state) Q_EMIT optimizerChanged();
}

}  // namespace retint
