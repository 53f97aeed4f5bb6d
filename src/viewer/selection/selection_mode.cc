// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_mode.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <span>
#include <utility>

#include <QFrame>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QVBoxLayout>

#include "opening/photo_paint.h"
#include "selecting/view_mask.h"
#include "selection/view_depth.h"
#include "viewer/selection/accept_button.h"
#include "viewer/selection/reach_choice.h"
#include "viewer/selection/scene_question.h"
#include "viewer/selection/selection_bar.h"

namespace retint {
namespace {

constexpr int kCloudCells = 280;  // across the width of a painted view
constexpr int kLeastWidth = 410;  // pixels that painting needs

// The selection in a view: painted there, projected there, or rendered from there.
Mask MaskOnView(const RegionSelection& selection, const PaintedView& view, EditSession& session) {
  for (const PaintedView& painted : selection.source.painted) {
    const auto names = PaintedNames(session.scene().workspace(), painted);
    const auto at = std::find(names.begin(), names.end(), view.name);
    if (view.name.empty() || at == names.end()) continue;
    return OnViews(session.scene().workspace(), painted)[size_t(at - names.begin())].mask;
  }
  const auto found = selection.masks.find(view.name);
  if (found != selection.masks.end()) return found->second;
  return session.selection().SeenFrom(selection, view.camera);
}

// The selection in the pixels to paint on.
Mask MaskOf(const RegionSelection& selection, const PaintedView& paper, EditSession& session) {
  for (const PaintedView& painted : selection.source.painted) {
    if (IsOnPhoto(paper) && IsOnPhoto(painted) && painted.name == paper.name) return painted.mask;
  }
  std::vector<Mask> on_views;
  for (const PaintedView& view : OnViews(session.scene().workspace(), paper)) {
    on_views.push_back(MaskOnView(selection, view, session));
  }
  return FromViews(session.scene().workspace(), paper, std::move(on_views));
}

ViewLayers LayersOf(const PaintedView& paper, std::span<const float> sh, EditSession& session) {
  if (IsOnPhoto(paper)) {
    const Pictures pictures = session.scene().pictures();
    return LayersOf(session.scene(), pictures.RequireOne(paper.name), sh);
  }
  session.scene().renderer().SetSh(sh);
  ViewLayers layers;
  layers.camera = paper.camera;
  layers.color = session.scene().renderer().Render(paper.camera).rgb;
  const Reconstruction& reconstruction = session.scene().reconstruction();
  const View* view = reconstruction.FindView(paper.name);
  layers.depth = SurfaceDepth(session.scene().renderer(), paper.camera, view, reconstruction);
  layers.surface =
      SurfaceDepth(session.scene().renderer(), paper.camera, view, reconstruction, true);
  return layers;
}

// The width of a view in pixels; 0 if unknown.
int WidthOf(const RegionSelection& selection, const std::string& view) {
  const auto mask = selection.masks.find(view);
  if (mask != selection.masks.end()) return mask->second.width;
  for (const PaintedView& painted : selection.source.painted) {
    if (painted.name == view) return painted.mask.width;
  }
  return 0;
}

}  // namespace

std::shared_ptr<OverlayCloud> MakeOverlayCloud(const RegionSelection& selection,
                                               size_t most_points) {
  const auto& points = selection.source.cloud.points;
  if (points.empty() || most_points == 0) return nullptr;
  auto cloud = std::make_shared<OverlayCloud>();
  // More than for masks: the depth of the points was measured, that of the scene is the Gaussians'.
  cloud->depth_tolerance = 0.05;
  // One point per cell of the painted view, so that the color below shows in between.
  std::vector<int> cells;
  for (const std::string& source : selection.source.cloud.sources) {
    cells.push_back(std::max(1, WidthOf(selection, source) / kCloudCells));
  }
  std::set<std::array<int, 3>> taken;
  std::vector<Eigen::Vector3f> kept;
  for (const SelectionPoint& point : points) {
    const int cell = point.source < cells.size() ? cells[point.source] : 1;
    const std::array<int, 3> at = {point.source, point.x / cell, point.y / cell};
    if (cell == 1 || taken.insert(at).second) kept.push_back(point.position);
  }
  const size_t step = (kept.size() + most_points - 1) / most_points;
  cloud->points.reserve(kept.size() / step + 1);
  for (size_t i = 0; i < kept.size(); i += step) cloud->points.push_back(kept[i]);
  return cloud;
}

// The worker's results for a view.
struct SelectionMode::Frozen {
  QImage image;
  ViewLayers layers;
  Mask mask;
  std::shared_ptr<const RegionSelection> selection;
};

SelectionMode::SelectionMode(SceneController* controller, QWidget* parent)
    : QWidget(parent), controller_(controller) {
  setObjectName("selectionMode");
  canvas_ = new SelectionCanvas;
  canvas_->setMinimumWidth(kLeastWidth);
  tools_ = new ToolStrip(canvas_);
  actions_ = new ActionStrip(canvas_);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(0);
  layout->addWidget(tools_);
  layout->addWidget(canvas_, 1);
  layout->addWidget(actions_);
  setFocusProxy(canvas_);
  question_ = new SceneQuestion(controller_, this);

  auto* progress = new QFrame(this);
  progress->setFrameShape(QFrame::StyledPanel);
  progress->setAutoFillBackground(true);
  progress_ = progress;
  stage_ = new QLabel;
  bar_ = new QProgressBar;
  bar_->setRange(0, 1000);
  bar_->setMinimumWidth(280);
  stop_ = new QPushButton(tr("Cancel"));
  stop_->setObjectName("selectionStop");
  stop_->setToolTip(tr("Back to painting (Esc)"));
  auto* rows = new QVBoxLayout(progress);
  rows->setContentsMargins(16, 12, 16, 12);
  rows->addWidget(stage_);
  auto* row = new QHBoxLayout;
  row->addWidget(bar_, 1);
  row->addWidget(stop_);
  rows->addLayout(row);
  progress_->hide();

  connect(new AcceptButton(canvas_), &QPushButton::clicked, this, &SelectionMode::Accept);
  SetProjectorOptions(project_);
  connect(&tools_->reach(), &ReachChoice::chosen, this, [this](PaintReach reach) {
    SetReach(reach, &project_);
    canvas_->setFocus();
    Q_EMIT reachChanged();
  });
  connect(stop_, &QPushButton::clicked, this, &SelectionMode::Leave);
  connect(canvas_, &SelectionCanvas::acceptRequested, this, &SelectionMode::Accept);
  connect(canvas_, &SelectionCanvas::leaveRequested, this, &SelectionMode::Leave);
  connect(canvas_, &SelectionCanvas::found, this, [this] {
    if (!canvas_->IsFinding() && std::exchange(accepts_found_, false)) Accept();
  });
  connect(canvas_, &SelectionCanvas::findingChanged, this, [this] {
    if (!canvas_->IsFinding()) accepts_found_ = false;  // it was cancelled, or found nothing
  });
  connect(actions_, &ActionStrip::accept, this, &SelectionMode::Accept);
  connect(actions_, &ActionStrip::cancel, this, &SelectionMode::Leave);
  connect(actions_, &ActionStrip::targetChosen, this, &SelectionMode::ChooseTarget);
  connect(controller_, &SceneController::failed, this, &SelectionMode::TaskFailed);
  connect(controller_, &SceneController::cancelled, this,
          [this](const QString& label, quint64 task) {
            if (task != 0 && task == task_)
              TaskFailed(label, tr("Cancelled, nothing was changed"), task);
          });
  connect(controller_, &SceneController::progress, this, &SelectionMode::Progressed);
  connect(controller_, &SceneController::closed, this, [this] {
    has_draft_ = false;
    draft_selection_.reset();
    if (state_ == State::kIdle) return;
    Finish();
    Q_EMIT left();
  });
  SetState(State::kIdle);
}

void SelectionMode::SetProjectorOptions(const ProjectorOptions& options) {
  project_ = options;
  tools_->reach().Show(ReachOf(project_));
}

QString SelectionMode::message() const { return actions_->message(); }

bool SelectionMode::HoldsPaint() const {
  return state_ != State::kComputing && Resumes(entry_) &&
         canvas_->editor().mask().data != before_.data;
}

void SelectionMode::SetState(State state) {
  state_ = state;
  const bool painting = state == State::kPainting;
  canvas_->SetPaintable(painting);
  if (!painting) question_->Withdraw();
  canvas_->findChild<AcceptButton*>()->SetPaintable(painting);
  tools_->setEnabled(painting);
  actions_->SetPaintable(painting);
  progress_->setVisible(state == State::kComputing);
  if (state == State::kComputing) {
    stage_->setText(tr("Waiting for the tasks before it"));
    bar_->setValue(0);
    PlaceProgress();
    stop_->setEnabled(true);
    stop_->setFocus();
  } else if (state != State::kIdle) {
    canvas_->setFocus();
  }
}

void SelectionMode::Finish() {
  ++visit_;
  SetState(State::kIdle);
}

// --- Entering ----------------------------------------------------------------------------------

bool SelectionMode::Resumes(const SelectionEntry& entry) const {
  const Region* region = controller_->regions().Find(entry.region);
  return has_draft_ && canvas_->HasView() && entry_.view == entry.view &&
         entry_.region == entry.region && entry_.camera == entry.camera &&
         (entry.region == 0 || region) &&
         draft_selection_ == (region ? region->selection : nullptr);
}

bool SelectionMode::Enter(const SelectionEntry& entry) {
  if (!controller_->IsOpen() || state_ == State::kComputing) return false;
  const Region* region = entry.region ? controller_->regions().Find(entry.region) : nullptr;
  if (entry.region && !region) return false;
  const auto selection = region ? region->selection : nullptr;
  const bool resumes = Resumes(entry);
  entry_ = entry;
  entry_.picture = {};
  ShowTargets();
  const uint64_t visit = ++visit_;
  if (resumes) {
    SetState(State::kPainting);
    actions_->ShowMessage(tr("Your strokes of the last visit are still here"), false);
    Q_EMIT ready();
    return true;
  }
  has_draft_ = false;
  SetState(State::kRendering);
  if (!entry.picture.isNull()) canvas_->ShowPicture(entry.picture);
  actions_->ShowMessage(tr("Rendering the view"), false);
  const auto frozen = std::make_shared<Frozen>();
  frozen->selection = selection;
  const ShPointer sh = controller_->colors().sh();
  task_ = controller_->Run(
      {},
      [frozen, sh, entry = entry_](EditSession& session, Monitor&) {
        PaintedView paper{entry.view.toStdString(), entry.camera,
                          Mask(entry.camera.camera.width, entry.camera.camera.height)};
        frozen->layers = LayersOf(paper, sh ? *sh : session.scene().original().sh, session);
        frozen->image = ToQImage(frozen->layers.color);
        frozen->mask =
            frozen->selection ? MaskOf(*frozen->selection, paper, session) : std::move(paper.mask);
      },
      [this, frozen, visit] {
        if (visit == visit_ && state_ == State::kRendering) ShowFrozen(frozen);
      });
  return task_ != 0;
}

void SelectionMode::ShowTargets() {
  QStringList names = {tr("New region")};
  targets_ = {0};
  for (const Region& other : controller_->regions().regions) {
    names << QString::fromStdString(other.name);
    targets_.push_back(other.id);
  }
  const auto current = std::find(targets_.begin(), targets_.end(), entry_.region);
  actions_->SetTargets(names, static_cast<int>(current - targets_.begin()),
                       entry_.view.isEmpty() ? tr("in a free view") : tr("in %1").arg(entry_.view));
}

void SelectionMode::ChooseTarget(int index) {
  if (state_ != State::kPainting || index < 0 || index >= static_cast<int>(targets_.size())) return;
  SelectionEntry entry = entry_;
  entry.region = targets_[static_cast<size_t>(index)];
  if (entry.region == entry_.region || Enter(entry)) return;
  ShowTargets();
  actions_->ShowMessage(tr("This region no longer exists"), true);
}

void SelectionMode::ShowFrozen(const std::shared_ptr<Frozen>& frozen) {
  before_ = frozen->mask;
  draft_selection_ = frozen->selection;
  canvas_->SetView(frozen->image, std::move(frozen->layers), std::move(frozen->mask));
  has_draft_ = true;
  actions_->ShowMessage({}, false);
  SetState(State::kPainting);
  Q_EMIT ready();
}

// --- Leaving -----------------------------------------------------------------------------------

void SelectionMode::Leave() {
  if (state_ == State::kIdle) return;
  if (state_ == State::kComputing) {
    stop_->setEnabled(false);
    stage_->setText(tr("Cancelling"));
    controller_->Cancel();
    return;
  }
  canvas_->CancelDrawing();
  Finish();
  Q_EMIT left();
}

QString SelectionMode::NewName() const {
  for (int number = 1;; ++number) {
    const QString name = tr("Region %1").arg(number);
    const auto& regions = controller_->regions().regions;
    if (std::none_of(regions.begin(), regions.end(),
                     [&](const Region& region) { return region.name == name.toStdString(); })) {
      return name;
    }
  }
}

void SelectionMode::Accept() {
  if (state_ != State::kPainting) return;
  if (canvas_->IsFinding()) {
    accepts_found_ = true;
    return;
  }
  canvas_->editor().EndStroke();
  const MaskEditor& editor = canvas_->editor();
  if (entry_.region && !controller_->regions().Find(entry_.region)) {
    actions_->ShowMessage(
        tr("The region was removed. Leave with Esc and undo that; the strokes are kept"), true);
    return;
  }
  if (!editor.AnyInside()) {
    actions_->ShowMessage(entry_.region
                              ? tr("Nothing would be left; delete the region in its panel")
                              : tr("Nothing is selected: paint something first"),
                          true);
    return;
  }
  if (entry_.region && editor.mask().data == before_.data) {
    actions_->ShowMessage(tr("Nothing was changed"), true);
    return;
  }
  SceneController::Round round;
  round.paint.view = {entry_.view.toStdString(), entry_.camera, editor.mask()};
  round.paint.view.outlined_by = canvas_->outlined_by();
  if (entry_.region) round.paint.before = before_;
  round.base = entry_.region;
  round.name = NewName();
  round.select = select_;
  round.project = project_;
  const uint64_t visit = ++visit_;
  SetState(State::kComputing);
  task_ = controller_->SelectRound(std::move(round), [this, visit](RegionId id) {
    if (visit != visit_) return;
    has_draft_ = false;
    Finish();
    Q_EMIT accepted(id);
  });
}

void SelectionMode::TaskFailed(const QString& label, const QString& message, quint64 task) {
  const bool waits = state_ == State::kComputing || state_ == State::kRendering;
  if (!waits || task == 0 || task != task_) {
    if (state_ != State::kIdle) Q_EMIT otherFailed(label, message);
    return;
  }
  if (state_ == State::kComputing) {
    ++visit_;
    SetState(State::kPainting);
  }
  actions_->ShowMessage(message, true);
}

void SelectionMode::Progressed(const QString& stage, double fraction) {
  if (state_ != State::kComputing || !stop_->isEnabled()) return;
  stage_->setText(stage.left(1).toUpper() + stage.mid(1));
  bar_->setValue(static_cast<int>(1000 * fraction));
}

// --- Events ------------------------------------------------------------------------------------

bool SelectionMode::event(QEvent* event) {
  // Keys reach the canvas if the focus is anywhere in this mode.
  if (event->type() == QEvent::ShortcutOverride && state_ != State::kIdle &&
      canvas_->WantsKey(*static_cast<QKeyEvent*>(event))) {
    event->accept();
    return true;
  }
  return QWidget::event(event);
}

void SelectionMode::keyPressEvent(QKeyEvent* event) {
  if (!canvas_->HandleKey(*event)) QWidget::keyPressEvent(event);
}

void SelectionMode::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  PlaceProgress();
}

void SelectionMode::PlaceProgress() {
  progress_->adjustSize();
  progress_->resize(std::min(progress_->width(), width()), progress_->height());
  progress_->move((width() - progress_->width()) / 2, (height() - progress_->height()) / 2);
  progress_->raise();
}

}  // namespace retint
