// SPDX-License-Identifier: BSD-3-Clause
// The colors on screen, and the background optimizer that improves them. Colors are composed on a
// thread of their own, the optimizer has the session's thread. All calls and signals are on the GUI
// thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <QObject>
#include <QTimer>

#include "editing/edit_session.h"
#include "scene/gaussian_model.h"

namespace retint {

class SceneController;
class ShComposer;

// A scene's coefficients, [N, K, 3]: immutable, and shared with all that show them.
using ShPointer = std::shared_ptr<const FloatArray>;
// Gaussians whose coefficients may differ from the original's; null: all may.
using ActivePointer = std::shared_ptr<const std::vector<int32_t>>;

// True for a region without a chosen color, or with one that was set back to white.
inline bool ChangesNothing(const ColorEdit& edit) {
  if (!edit.IsAffine() || edit.HasPaint()) return false;
  const auto [gain, offset] = edit.Affine();
  return gain == Eigen::Matrix3f::Identity() && offset.isZero(0);
}

struct OptimizerStatus {
  BackgroundOptimizer::State state = BackgroundOptimizer::State::kIdle;
  RegionId region = 0;         // the fitted region, 0: none
  int steps = 0;               // of the current job
  double seconds = 0;          // since the start of the job, without pauses
  std::vector<double> losses;  // of the current region
  std::string error;           // why it failed
  bool Active() const {
    return state == BackgroundOptimizer::State::kRunning ||
           state == BackgroundOptimizer::State::kPaused;
  }
};

class SceneColors : public QObject {
  Q_OBJECT

 public:
  explicit SceneColors(SceneController* scene);
  ~SceneColors() override;  // cancels the optimizer

  // For the controller: a scene was opened, or will be closed; the shown colors may have changed.
  void Begin(std::shared_ptr<EditSession> session);
  void End();
  void Refresh();
  void Compose();

  // The newest of closed form, fits and the optimizer's snapshot. Before any edit, the original's.
  ShPointer sh() const { return sh_; }
  ActivePointer sh_active() const { return sh_active_; }
  ShPointer original_sh() const { return original_; }
  uint64_t sh_version() const { return sh_version_; }
  // No region is shown: sh() is the original.
  bool ShowsOriginal() const { return sh_ == original_; }

  // For the next start. If `automatic` is on (the default), each edit starts the optimizer.
  void SetRefitJob(const RefitJob& job);
  const RefitJob& refit_job() const { return job_; }
  void SetAutomaticRefit(bool automatic);
  bool automatic_refit() const { return automatic_; }
  void StartRefit();
  void PauseRefit();
  void ResumeRefit();
  void CancelRefit();
  OptimizerStatus optimizer() const { return optimizer_; }

 Q_SIGNALS:
  void shChanged();         // sh()
  void optimizerChanged();  // optimizer()
  void refitJobChanged();   // refit_job()

 private:
  void SetSh(ShPointer sh, ActivePointer active = nullptr);
  void PollOptimizer();
  RegionSet Shown() const;
  std::string KeyOfShown() const;

  SceneController& scene_;
  // Only its optimizer is used here; any thread may call that.
  std::shared_ptr<EditSession> session_;
  ShPointer original_, sh_;
  ActivePointer sh_active_;
  uint64_t sh_version_ = 0;
  std::string shown_key_;    // of the colors that sh_ has or will have
  uint64_t generation_ = 0;  // counts changes of shown_key_
  RefitJob job_, started_job_;
  bool automatic_ = true;
  uint64_t refit_generation_ = 0, refit_number_ = 0;  // of the current job
  std::shared_ptr<const ShSnapshot> snapshot_;
  OptimizerStatus optimizer_;
  QTimer poll_, restart_;
  std::unique_ptr<ShComposer> composer_;  // last: its thread calls into the other members
};

}  // namespace retint
