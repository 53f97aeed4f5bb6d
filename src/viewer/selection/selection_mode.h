// SPDX-License-Identifier: BSD-3-Clause
// Selection mode: freezes a view to paint on, then accepts the strokes as a region, or as another
// round of one. Long work runs on the controller's worker; the widget only shows its progress.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <QImage>
#include <QString>
#include <QWidget>

#include "selection/paint_reach.h"
#include "viewer/canvas/render_thread.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/selection/selection_canvas.h"

class QLabel;
class QProgressBar;
class QPushButton;

namespace retint {

class ActionStrip;
class SceneQuestion;
class ToolStrip;

// A region's cloud for the scene's canvas; null if it has none. Thins out points that would cover
// the picture, to at most `most_points`.
std::shared_ptr<OverlayCloud> MakeOverlayCloud(const RegionSelection& selection,
                                               size_t most_points = 200000);

// How to enter selection mode.
struct SelectionEntry {
  QString view;         // of a view or a distorted photo of the workspace; empty: `camera` is free
  PosedCamera camera;   // camera of the painted pixels: the view's, the photo's, or any pinhole
  RegionId region = 0;  // the round extends and erases this region; 0: a new one
  QImage picture;       // shown until the sharp view is rendered; may be null
};

class SelectionMode : public QWidget {
  Q_OBJECT

 public:
  explicit SelectionMode(SceneController* controller, QWidget* parent = nullptr);

  // Freezes a view, then emits ready(). If the user left the same place without accepting, strokes
  // and history are still there. False if no scene is open, or a selection is being computed.
  bool Enter(const SelectionEntry& entry);
  // Computes depth, cloud, registration, masks, then the region: accepted(). message() says why a
  // selection cannot be accepted. After a failure or a cancellation, the user can go on painting.
  void Accept();
  // Leaves the mode and keeps the strokes for the next visit. During a computation: cancels that.
  void Leave();

  enum class State { kIdle, kRendering, kPainting, kComputing };
  State state() const { return state_; }
  const SelectionEntry& entry() const { return entry_; }
  SelectionCanvas& canvas() { return *canvas_; }
  SceneQuestion& question() { return *question_; }
  QString message() const;
  // Whether there are strokes that were not accepted, even on a view that was left. Entering at
  // another place discards them.
  bool HoldsPaint() const;
  // Whether Enter() would continue with the strokes of the last visit. The region must not have
  // changed since.
  bool Resumes(const SelectionEntry& entry) const;
  // For the next Accept().
  const SelectOptions& select_options() const { return select_; }
  const ProjectorOptions& projector_options() const { return project_; }
  void SetSelectOptions(const SelectOptions& options) { select_ = options; }
  void SetProjectorOptions(const ProjectorOptions& options);

 Q_SIGNALS:
  void reachChanged();                 // projector_options(), through the choice in the tool strip
  void ready();                        // painting can begin
  void accepted(retint::RegionId id);  // a region is new or changed; the mode has ended
  void left();                         // without a change
  // Other work failed in the meantime, which message() does not report.
  void otherFailed(const QString& label, const QString& message);

 protected:
  bool event(QEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  struct Frozen;
  void ShowFrozen(const std::shared_ptr<Frozen>& frozen);
  void SetState(State state);
  void ShowTargets();
  void ChooseTarget(int index);
  void Finish();
  void PlaceProgress();
  void TaskFailed(const QString& label, const QString& message, quint64 task);
  void Progressed(const QString& stage, double fraction);
  QString NewName() const;

  SceneController* controller_;
  ToolStrip* tools_;
  SelectionCanvas* canvas_;
  ActionStrip* actions_;
  SceneQuestion* question_;
  QWidget* progress_;
  QLabel* stage_;
  QProgressBar* bar_;
  QPushButton* stop_;
  SelectOptions select_;
  ProjectorOptions project_;
  State state_ = State::kIdle;
  SelectionEntry entry_;
  std::vector<RegionId> targets_;     // in the order of the list; 0: a new region
  Mask before_;                       // the mask on entering
  SceneController::TaskId task_ = 0;  // the current one of this mode
  uint64_t visit_ = 0;                // identifies this visit, to ignore late answers for another
  // Where the strokes of the canvas belong.
  std::shared_ptr<const RegionSelection> draft_selection_;
  bool has_draft_ = false;
  bool accepts_found_ = false;  // accept as soon as the current search has an outline
};

}  // namespace retint
