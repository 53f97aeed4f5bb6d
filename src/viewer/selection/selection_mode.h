// SPDX-License-Identifier: BSD-3-Clause
// Selection mode: one view frozen, painted on, and accepted as a region or as another round of one.
// Everything long runs on the controller's worker; the widget only shows how far it is.
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

// A region's cloud as the scene's canvas draws it; null when it has none. Points that would cover
// the picture are thinned, and to at most `most_points`.
std::shared_ptr<OverlayCloud> MakeOverlayCloud(const RegionSelection& selection,
                                               size_t most_points = 200000);

// The picture in which selection mode is entered.
struct SelectionEntry {
  QString view;  // of a view or a distorted photo of the workspace; empty: `camera` stands freely
  PosedCamera camera;   // in whose pixels one paints: the view's, the photo's, or any pinhole
  RegionId region = 0;  // the region that the round extends and erases; 0: a new one
  QImage picture;       // shown until the sharp view has been rendered; may be null
};

class SelectionMode : public QWidget {
  Q_OBJECT

 public:
  explicit SelectionMode(SceneController* controller, QWidget* parent = nullptr);

  // Freezes a view: ready() follows. Entering where one left without accepting goes on with the
  // same strokes and their history. False when no scene is open or a selection is being computed.
  bool Enter(const SelectionEntry& entry);
  // Depth, cloud, registration and masks, then the region: accepted(). message() says why a
  // selection cannot be accepted; failures and cancelling lead back to painting.
  void Accept();
  // Out of the mode; strokes are kept for the next visit. While computing: cancels that instead.
  void Leave();

  enum class State { kIdle, kRendering, kPainting, kComputing };
  State state() const { return state_; }
  const SelectionEntry& entry() const { return entry_; }
  SelectionCanvas& canvas() { return *canvas_; }
  SceneQuestion& question() { return *question_; }
  QString message() const;
  // Whether there are strokes that were not accepted, also of a view that was left. Entering
  // anywhere else gives them up.
  bool HoldsPaint() const;
  // Whether entering there goes on with the strokes of the last visit: the region is still what it
  // was painted on.
  bool Resumes(const SelectionEntry& entry) const;
  // Of the next Accept().
  const SelectOptions& select_options() const { return select_; }
  const ProjectorOptions& projector_options() const { return project_; }
  void SetSelectOptions(const SelectOptions& options) { select_ = options; }
  void SetProjectorOptions(const ProjectorOptions& options);

 Q_SIGNALS:
  void reachChanged();                 // projector_options(), by the choice in the tool strip
  void ready();                        // the view can be painted
  void accepted(retint::RegionId id);  // a region was made or changed; the mode is over
  void left();                         // without a change
  // Something else than the mode's own work failed meanwhile, of which it says nothing.
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
  std::vector<RegionId> targets_;     // as listed; 0: a new region
  Mask before_;                       // the mask on entering
  SceneController::TaskId task_ = 0;  // the mode's own that runs
  uint64_t visit_ = 0;                // tells the answers for this visit from late ones
  // Of the strokes that the canvas holds: where they belong.
  std::shared_ptr<const RegionSelection> draft_selection_;
  bool has_draft_ = false;
  bool accepts_found_ = false;  // accepts once the outline that is looked for is found
};

}  // namespace retint
