// SPDX-License-Identifier: BSD-3-Clause
// The controller's optimiser, quality and output.
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "viewer/scene_controller.h"

namespace retint {
namespace {

using OptimizerState = BackgroundOptimizer::State;

}  // namespace

// --- Background optimiser
// -------------------------------------------------------------------------

void SceneController::SetRefitJob(const RefitJob& job) {
  job.options.Check();
  job_ = job;
}

void SceneController::SetAutomaticRefit(bool automatic) {
  automatic_ = automatic;
  if (!automatic) restart_.stop();
}

void SceneController::StartRefit() {
  restart_.stop();
  if (!session_) return;
  const uint64_t generation = generation_;
  const RefitJob job = job_;
  const auto number = std::make_shared<uint64_t>(0);
  Run(
      job.target == TargetKind::kPhoto ? tr("Reading photos") : QString(),
      [=](EditSession& session, Monitor&) {
        session.CollectFits();
        *number = session.StartRefit(job);
      },
      [=, this] {
        started_job_ = job;
        shown_key_ = KeyOfShown();
        refit_generation_ = generation;
        refit_number_ = *number;
        optimizer_ = {};
        optimizer_.state = OptimizerState::kRunning;
        if (generation != generation_) {
          // Edited while the job waited for its turn.
          session_->optimizer().Cancel();
          if (automatic_) restart_.start();
        }
        poll_.start();
        Q_EMIT optimizerChanged();
      });
}

void SceneController::PauseRefit() {
  if (!session_) return;
  session_->optimizer().Pause();
  PollOptimizer();
}

void SceneController::ResumeRefit() {
  if (!session_) return;
  session_->optimizer().Resume();
  PollOptimizer();
}

void SceneController::CancelRefit() {
  restart_.stop();
  if (!session_) return;
  session_->optimizer().Cancel();
  PollOptimizer();
}

void SceneController::PollOptimizer() {
  if (!session_) return;
  const OptimizerStatus old = optimizer_;
  optimizer_.state = session_->optimizer().state();
  if (old.state == OptimizerState::kRunning) optimizer_.seconds += poll_.interval() / 1000.0;
  const auto newest = session_->NewestSnapshot();
  const bool news = newest && newest != snapshot_ && newest->job == refit_number_;
  if (news) {
    snapshot_ = newest;
    optimizer_.steps = newest->steps;
    optimizer_.region = newest->region;
    if (newest->region != 0) optimizer_.losses = newest->losses;
    if (refit_generation_ == generation_ && solo_ == 0 && !shown_key_.empty()) SetSh(newest->sh);
  }
  if (!optimizer_.Active()) {
    poll_.stop();
    if (optimizer_.state == OptimizerState::kFinished && old.Active()) {
      Run({}, [](EditSession& session, Monitor&) { session.CollectFits(); });
    }
    if (optimizer_.state == OptimizerState::kFailed && old.Active()) {
      optimizer_.error = session_->optimizer().error();
      Q_EMIT failed(tr("Refit"), QString::fromStdString(optimizer_.error));
    }
  }
  if (news || old.state != optimizer_.state) Q_EMIT optimizerChanged();
}

// --- Results
// --------------------------------------------------------------------------------------

void SceneController::Evaluate(RegionId id) {
  const auto report = std::make_shared<QualityReport>();
  Run(
      tr("Measuring quality"),
      [=, sh = sh_, original = original_sh(), target = job_.target](EditSession& session,
                                                                    Monitor& monitor) {
        *report = session.Evaluate(id, *original, *sh, target, monitor);
      },
      [=, this] { Q_EMIT qualityReady(id, *report); });
}

void SceneController::RunWrite(const QString& label, const std::filesystem::path& path, Work work) {
  Run(label, std::move(work), [=, this] { Q_EMIT written(QString::fromStdString(path.string())); });
}

void SceneController::WriteSplat(const std::filesystem::path& path) {
  RunWrite(tr("Saving the splat"), path, [=](EditSession& session, Monitor& monitor) {
    monitor.Step("save", 0, 1);
    CheckOutput(path);
    session.CollectFits();
    session.WriteSplat(path);
    monitor.Step("save", 1, 1);
  });
}

void SceneController::WriteMasks(const std::filesystem::path& folder, RegionId id) {
  RunWrite(tr("Saving masks"), folder, [=](EditSession& session, Monitor& monitor) {
    monitor.Step("save", 0, 1);
    StagedOutput output;
    output.AddFolder(folder, [&](const auto& staged) { session.WriteMasks(staged, id); });
    output.Commit();
    monitor.Step("save", 1, 1);
  });
}

void SceneController::WriteReport(const std::filesystem::path& path) {
  RunWrite(
      tr("Saving the report"), path,
      [=, original = original_sh(), target = job_.target](EditSession& session, Monitor& monitor) {
        CheckOutput(path);
        session.CollectFits();
        RunReport report = session.MakeReport();
        const auto& regions = session.regions().regions;
        const auto shown = std::find_if(regions.begin(), regions.end(),
                                        [](const Region& region) { return region.visible; });
        if (shown != regions.end()) {
          double sum = 0;
          for (const auto& [name, mask] : shown->selection->masks) {
            double inside = 0;
            for (const uint8_t value : mask.data) inside += value >= 128 ? 1 : 0;
            if (inside > 0) ++report.mask_views;
            sum += inside / static_cast<double>(std::max<size_t>(1, mask.NumPixels()));
          }
          report.mean_coverage =
              sum / static_cast<double>(std::max<size_t>(1, shown->selection->masks.size()));
          report.quality =
              session.Evaluate(shown->id, *original, session.CurrentSh(), target, monitor);
        }
        WriteFile(path, ToJson(report) + "\n");
      });
}

void SceneController::WriteViews(const std::filesystem::path& folder) {
  RunWrite(tr("Saving views"), folder, [=, sh = sh_](EditSession& session, Monitor& monitor) {
    CheckOutput(folder, /*as_folder=*/true);
    const auto views = session.reconstruction().ViewsByName();
    StagedOutput output;
    output.AddFolder(folder, [&](const auto& staged) {
      for (size_t i = 0; i < views.size(); ++i) {
        monitor.Step("save", static_cast<double>(i), static_cast<double>(views.size()));
        WritePng(ViewFile(staged, views[i]->name), session.RenderView(*views[i], *sh));
      }
    });
    output.Commit();
    monitor.Step("save", 1, 1);
  });
}

void SceneController::WriteFrames(const std::filesystem::path& folder,
                                  std::vector<PosedCamera> cameras) {
  RunWrite(tr("Saving frames"), folder,
           [=, sh = sh_, cameras = std::move(cameras)](EditSession& session, Monitor& monitor) {
             CheckOutput(folder, /*as_folder=*/true);
             session.ShowSh(*sh);
             RenderRequest request;
             request.cache = false;
             StagedOutput output;
             output.AddFolder(folder, [&](const std::filesystem::path& staged) {
               for (size_t i = 0; i < cameras.size(); ++i) {
                 monitor.Step("save", static_cast<double>(i), static_cast<double>(cameras.size()));
                 const QString name = QStringLiteral("%1.png").arg(i, 4, 10, QLatin1Char('0'));
                 WritePng(staged / name.toStdString(),
                          session.renderer().Render(cameras[i], request).rgb);
               }
             });
             output.Commit();
             monitor.Step("save", 1, 1);
           });
}

}  // namespace retint
