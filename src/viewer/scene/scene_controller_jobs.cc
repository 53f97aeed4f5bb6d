// SPDX-License-Identifier: BSD-3-Clause
// The controller's optimizer, quality and output.
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "opening/scene_check.h"
#include "reporting/export.h"
#include "viewer/scene/scene_controller.h"

namespace retint {
namespace {

using OptimizerState = BackgroundOptimizer::State;

constexpr size_t kGlancedViews = 4;
constexpr int kBetween = 8;  // white pixels between the sides of a comparison

// What an exported splat has, also while one region is looked at alone.
FloatArray ColorsToExport(EditSession& session) {
  session.refits().CollectFits();
  return session.refits().CurrentSh();
}

std::string EditKeyOf(const RegionSet& regions, RegionId id) {
  const auto found = std::ranges::find(regions.regions, id, &Region::id);
  if (found == regions.regions.end()) return {};
  return regions.FitKey(size_t(found - regions.regions.begin()), RefitJob());
}

// The quality of an edit, and which edit that was.
struct Measured {
  QualityReport report;
  std::string edit;
};

}  // namespace

// ---- Background optimizer

void SceneController::SetRefitJob(const RefitJob& job) {
  job.options.Check();
  job_ = job;
  Q_EMIT refitJobChanged();
}

void SceneController::SetAutomaticRefit(bool automatic) {
  if (automatic == automatic_) return;
  automatic_ = automatic;
  if (!automatic) restart_.stop();
  Q_EMIT optimizerChanged();
}

void SceneController::StartRefit() {
  restart_.stop();
  if (!session_) return;
  const uint64_t generation = generation_;
  const RefitJob job = job_;
  Ask(
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
          // Edited while the job waited for its turn.
          session_->refits().optimizer().Cancel();
          if (automatic_) restart_.start();
        }
        poll_.start();
        Q_EMIT optimizerChanged();
      });
}

void SceneController::PauseRefit() {
  if (!session_) return;
  session_->refits().optimizer().Pause();
  PollOptimizer();
}

void SceneController::ResumeRefit() {
  if (!session_) return;
  session_->refits().optimizer().Resume();
  PollOptimizer();
}

void SceneController::CancelRefit() {
  restart_.stop();
  if (!session_) return;
  session_->refits().optimizer().Cancel();
  PollOptimizer();
}

void SceneController::PollOptimizer() {
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
    } else if (!newest->fits.empty()) {  // all done: a quick fit may not have been seen on its way
      optimizer_.losses = newest->fits.rbegin()->second->summary.losses;
    }
    if (refit_generation_ == generation_ && solo_ == 0 && !shown_key_.empty()) SetSh(newest->sh);
  }
  if (!optimizer_.Active()) {
    poll_.stop();
    if (optimizer_.state == OptimizerState::kFinished && old.Active()) {
      Run({}, [](EditSession& session, Monitor&) { session.refits().CollectFits(); });
    }
    if (optimizer_.state == OptimizerState::kFailed && old.Active()) {
      optimizer_.error = session_->refits().optimizer().error();
      Q_EMIT failed(tr("Refit"), QString::fromStdString(optimizer_.error));
    }
  }
  if (news || old.state != optimizer_.state) Q_EMIT optimizerChanged();
}

// ---- Results

std::string SceneController::EditKey(RegionId id) const { return EditKeyOf(regions_, id); }

void SceneController::Evaluate(RegionId id) {
  measuring_ = Ask(
      tr("Measuring quality"),
      [=, target = job_.target](EditSession& session, Monitor& monitor) {
        session.refits().CollectFits();
        return Measured{EvaluateRegion(session, id, target, monitor),
                        EditKeyOf(session.store().regions(), id)};
      },
      [=, this](const Measured& measured) {
        const bool changed = regions_.Find(id) && EditKey(id) != measured.edit;
        if (changed) return Evaluate(id);  // while it was measured
        Q_EMIT qualityReady(id, measured.report);
      });
}

void SceneController::Glance(RegionId id) {
  Ask(
      {},
      [=, target = job_.target](EditSession& session, Monitor& monitor) {
        session.refits().CollectFits();
        if (!session.store().regions().Find(id)) return Measured();  // deleted meanwhile
        return Measured{EvaluateRegion(session, id, target, monitor, kGlancedViews),
                        EditKeyOf(session.store().regions(), id)};
      },
      [=, this](const Measured& measured) {
        const bool is_its = measured.report.train.views > 0 && EditKey(id) == measured.edit;
        if (is_its) Q_EMIT qualityGlanced(id, measured.report);
      });
}

void SceneController::Check() {
  Ask(
      {},
      [](EditSession& session, Monitor& monitor) { return CheckScene(session.scene(), monitor); },
      [this](const SceneCheck& check) { Q_EMIT sceneChecked(check.warnings); });
}

void SceneController::RunWrite(const QString& label, const std::filesystem::path& path, Work work,
                               std::function<void()> done) {
  Run(label, std::move(work), [=, this] {
    Q_EMIT written(QString::fromStdString(path.string()));
    if (done) done();
  });
}

void SceneController::WriteSplat(const std::filesystem::path& path) {
  RunWrite(tr("Saving the splat"), path, [=](EditSession& session, Monitor& monitor) {
    CheckOutput(path);
    session.refits().CollectFits();
    session.WriteSplat(path, monitor);
  });
}

void SceneController::WriteMasks(const std::filesystem::path& folder, RegionId id) {
  RunWrite(tr("Saving masks"), folder, [=](EditSession& session, Monitor& monitor) {
    StagedOutput output;
    output.AddFolder(folder, [&](const auto& staged) { session.WriteMasks(staged, id, monitor); });
    output.Commit();
  });
}

void SceneController::WriteReport(const std::filesystem::path& path) {
  RunWrite(tr("Saving the report"), path, [=, job = job_](EditSession& session, Monitor& monitor) {
    session.refits().CollectFits();
    ExportReport(session, job, path, monitor);
  });
}

void SceneController::WriteViews(const std::filesystem::path& folder,
                                 const std::vector<std::string>& names) {
  RunWrite(tr("Saving views"), folder, [=](EditSession& session, Monitor& monitor) {
    std::vector<const View*> views = session.scene().reconstruction().ViewsByName();
    if (!names.empty()) {
      std::erase_if(views, [&](const View* view) {
        return std::find(names.begin(), names.end(), view->name) == names.end();
      });
    }
    ExportViews(session, views, ColorsToExport(session), folder, monitor);
  });
}

void SceneController::WriteFrames(const std::filesystem::path& folder,
                                  std::vector<PosedCamera> cameras, std::function<void()> done,
                                  std::vector<std::filesystem::path> replaced) {
  RunWrite(
      tr("Saving frames"), folder,
      [=, cameras = std::move(cameras), replaced = std::move(replaced)](EditSession& session,
                                                                        Monitor& monitor) {
        ExportFrames(session, cameras, ColorsToExport(session), folder, monitor, replaced);
      },
      std::move(done));
}

void SceneController::WriteComparison(const std::filesystem::path& path, const PosedCamera& camera,
                                      std::shared_ptr<const LensPicture> lens) {
  RunWrite(tr("Saving the comparison"), path, [=](EditSession& session, Monitor&) {
    CheckOutput(path);
    const int width = camera.camera.width, height = camera.camera.height;
    Image both(2 * width + kBetween, height);
    std::fill(both.data.begin(), both.data.end(), 1.0F);
    const FloatArray edited = ColorsToExport(session);
    int left = 0;
    for (const FloatArray* colors : {&session.scene().original().sh, &edited}) {
      session.scene().renderer().SetSh(*colors);
      const Image side = DrawThrough(lens.get(), camera, [&](const PosedCamera& face) {
        return std::move(session.scene().renderer().Render(face).rgb);
      });
      for (int y = 0; y < height; ++y) {
        std::copy_n(side.data.begin() + std::ptrdiff_t(side.Index(0, y)), 3 * width,
                    both.data.begin() + std::ptrdiff_t(both.Index(left, y)));
      }
      left += width + kBetween;
    }
    WritePng(path, both);
  });
}

}  // namespace retint
