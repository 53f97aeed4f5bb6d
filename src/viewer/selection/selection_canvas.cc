// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_canvas.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QWheelEvent>

#include "scene/mask_pixels.h"
#include "viewer/canvas/contrast.h"
#include "viewer/selection/selection_keys.h"

namespace retint {
namespace {

constexpr double kLeastScale = 0.05, kMostScale = 64;
constexpr double kLeastRadius = 0.5, kMostRadius = 500;
constexpr double kClosing =
    10;                         // widget pixels; a click this close to the start closes the polygon
constexpr double kMargin = 60;  // widget pixels of the image that must stay visible

Eigen::Vector2d ToEigen(const QPointF& point) { return {point.x(), point.y()}; }

}  // namespace

SelectionCanvas::SelectionCanvas(QWidget* parent) : QWidget(parent) {
  setObjectName("selectionCanvas");
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setAttribute(Qt::WA_OpaquePaintEvent);
  setMinimumSize(160, 120);
  setAccessibleName(tr("Selection view"));
  finder_ = new OutlineFinder(this);
  connect(finder_, &OutlineFinder::busyChanged, this, [this] {
    UpdateCursor();
    Q_EMIT findingChanged();
    Q_EMIT hintChanged();
  });
  connect(finder_, &OutlineFinder::failed, this, &SelectionCanvas::NotFound);
  veil_ = new SelectionVeil(this);
  connect(veil_, &SelectionVeil::changed, this, [this](const GridRect& part) {
    if (!part.Empty()) update(WidgetRect(part));
  });
  UpdateCursor();
}

void SelectionCanvas::SetView(const QImage& image, ViewLayers layers, Mask mask) {
  CancelDrawing();
  ForgetScribbles();
  veil_->Clear();
  hatched_ = {};
  const bool same_size = image.size() == image_.size();
  image_ = image.convertToFormat(QImage::Format_RGB32);
  layers_ = std::make_shared<const ViewLayers>(std::move(layers));
  editor_.Reset(std::move(mask));
  outlined_by_.clear();
  ready_ = true;
  if (!same_size || fitted_) FitView();
  ChooseOverlayColor();
  UpdateCursor();
  update();
  Q_EMIT edited();
}

void SelectionCanvas::ShowPicture(const QImage& image) {
  CancelDrawing();
  ForgetScribbles();
  veil_->Clear();
  hatched_ = {};
  ready_ = false;
  image_ = image.convertToFormat(QImage::Format_RGB32);
  layers_.reset();
  editor_.Reset(Mask());
  FitView();
  UpdateCursor();
  Q_EMIT edited();
}

void SelectionCanvas::SetHatched(Mask where) {
  if (where.Empty() && hatched_.Empty()) return;
  hatched_ = std::move(where);
  update();
}

void SelectionCanvas::Edited(const GridRect& changed) {
  finder_->Cancel();
  ForgetScribbles();
  applied_ = 0;
  Changed(changed);
}

void SelectionCanvas::Changed(const GridRect& changed) {
  if (!changed.Empty()) update(WidgetRect(changed));
  if (!editor_.InStroke()) ChooseOverlayColor();
  Q_EMIT edited();
}

// Chooses a color that stands out from the selection.
void SelectionCanvas::ChooseOverlayColor() {
  const Mask& mask = editor_.mask();
  if (mask.width != image_.width() || mask.height != image_.height()) return;
  const QColor under = MeanColor(image_, [&](int x, int y) { return IsInside(mask(x, y)); });
  const QColor color = ContrastingColor(under, style_.color);
  if (color == style_.color) return;
  style_.color = color;
  update();
}

// --- Options -----------------------------------------------------------------------------------

void SelectionCanvas::SetTool(const SelectionTool& tool) {
  if (&tool == tool_) return;
  // A finished drawing is still searched for.
  if (drawing_ || tuning_ || editor_.InStroke()) CancelDrawing();
  // Scribbles correct the result of a network, and points for a network complete scribbles.
  if (!tool.acts.keeps_strokes || !acts().keeps_strokes) ForgetScribbles();
  tool_ = &tool;
  UpdateCursor();
  UpdateBrushOutline();
  Q_EMIT optionsChanged();
  Q_EMIT hintChanged();
}

void SelectionCanvas::SetBrush(const BrushOptions& brush) {
  BrushOptions& mine = IsScribble() ? outline_.scribble : brush_;
  mine.radius = std::clamp(brush.radius, kLeastRadius, kMostRadius);
  mine.hardness = std::clamp(brush.hardness, 0.0, 1.0);
  UpdateBrushOutline();
  Q_EMIT optionsChanged();
}

void SelectionCanvas::SetOutline(const OutlineOptions& outline) {
  outline_ = outline;
  Q_EMIT optionsChanged();
}

void SelectionCanvas::SetOverlayOpacity(double opacity) {
  style_.opacity = std::clamp(opacity, 0.0, 1.0);
  update();
  Q_EMIT optionsChanged();
}

void SelectionCanvas::SetPaintable(bool paintable) {
  if (!paintable) CancelDrawing();
  paintable_ = paintable;
  UpdateCursor();
  update();
}

void SelectionCanvas::ScaleBrush(int steps) {
  BrushOptions brush = this->brush();
  // By 10 %, at least half a pixel.
  for (int i = 0; i < std::abs(steps); ++i) {
    const double by = std::max(0.5, 0.1 * brush.radius);
    brush.radius = std::max(kLeastRadius, brush.radius + (steps > 0 ? by : -by));
  }
  SetBrush(brush);
}

// --- Operations --------------------------------------------------------------------------------

void SelectionCanvas::Undo() {
  if (drawing_ || tuning_ || IsFinding()) {
    CancelDrawing();
  } else if (!scribbles_.empty()) {
    UndoScribble();
  } else {
    applied_ = 0;
    Changed(editor_.Undo());
  }
}

void SelectionCanvas::Redo() {
  CancelDrawing();
  if (!undone_.empty()) {
    RedoScribble();
  } else {
    applied_ = 0;
    Changed(editor_.Redo());
  }
}

void SelectionCanvas::GrowBy(int pixels) {
  CancelDrawing();
  Edited(pixels > 0 ? editor_.Grow(pixels) : editor_.Shrink(-pixels));
}

void SelectionCanvas::Invert() {
  CancelDrawing();
  Edited(editor_.Invert());
}

void SelectionCanvas::SelectAll() {
  CancelDrawing();
  Edited(editor_.SelectAll());
}

void SelectionCanvas::SelectNone() {
  CancelDrawing();
  Edited(editor_.SelectNone());
}

bool SelectionCanvas::CancelDrawing() {
  if (editor_.InStroke()) {
    Edited(editor_.CancelStroke());
    return true;
  }
  if (!drawing_ && !tuning_ && !IsFinding()) return false;
  finder_->Cancel();
  std::erase_if(scribbles_, [](const Scribble& scribble) { return !scribble.found; });
  const uint64_t gesture = tuning_ ? tuning_->gesture : drawing_ ? drawing_->gesture : 0;
  if (tuning_) {
    acts().tolerance(outline_) = tuning_->tolerance;
    Q_EMIT optionsChanged();
  }
  tuning_.reset();
  drawing_.reset();
  const bool shows = gesture != 0 && applied_ == gesture;
  applied_ = 0;
  Changed(shows ? editor_.Undo() : GridRect{});
  Q_EMIT hintChanged();
  update();
  return true;
}

// --- Drawing -----------------------------------------------------------------------------------

Eigen::Vector2d SelectionCanvas::ImageAt(const QPointF& widget) const {
  return transform_.ToImage(ToEigen(widget));
}

void SelectionCanvas::Press(const Eigen::Vector2d& at, Qt::KeyboardModifiers modifiers) {
  const Combine combine = acts().combine(modifiers, editor_);
  if (IsBrush()) {
    Edited(editor_.BeginStroke(at, brush_, combine));
    return;
  }
  if (HasCorners()) {
    const double to_first = (drawing_->points.front() - at).norm() * transform_.scale;
    drawing_->points.back() = at;
    if (drawing_->points.size() > 3 && to_first < kClosing) {
      FinishDrawing();
      return;
    }
    drawing_->points.push_back(at);  // follows the cursor
    FindDrawn();
  } else if (const QString why = acts().refuse ? acts().refuse(*this, at) : QString();
             !why.isEmpty()) {
    NotFound(why);
    return;
  } else if (acts().gesture == Gesture::kTune) {
    tuning_ = Tuning{combine, at, *cursor_, acts().tolerance(outline_), ++gesture_};
    Tune(*cursor_);
  } else {
    drawing_ = Drawing{combine, {at, at}, ++gesture_};
  }
  Q_EMIT hintChanged();
  update();
}

// The last point follows the cursor, or is the place of the mouse's release.
void SelectionCanvas::FinishDrawing() {
  if (!drawing_) return;
  if (HasCorners()) drawing_->points.pop_back();
  const Drawing drawing = *std::exchange(drawing_, std::nullopt);
  update();
  if (acts().finish) acts().finish(*this, drawing);
  Q_EMIT hintChanged();
}

void SelectionCanvas::mousePressEvent(QMouseEvent* event) {
  cursor_ = event->position();
  modifiers_ = event->modifiers();
  const bool pans = event->button() == Qt::RightButton || event->button() == Qt::MiddleButton ||
                    (event->button() == Qt::LeftButton && space_);
  if (pans) {
    if (!editor_.InStroke()) pan_from_ = event->position();
    UpdateCursor();
  } else if (event->button() == Qt::LeftButton && ready_ && paintable_) {
    Press(ImageAt(event->position()), event->modifiers());
  } else if (event->button() == Qt::LeftButton) {
    Q_EMIT notFound(ready_ ? tr("Wait for the selection, or press Esc to paint on")
                           : tr("Wait until the view is made"));
  }
  UpdateBrushOutline();
}

void SelectionCanvas::mouseMoveEvent(QMouseEvent* event) {
  cursor_ = event->position();
  modifiers_ = event->modifiers();
  const Eigen::Vector2d at = ImageAt(event->position());
  if (pan_from_) {
    transform_.offset += ToEigen(event->position() - *std::exchange(pan_from_, cursor_));
    fitted_ = false;
    Moved();
  } else if (editor_.InStroke()) {
    Edited(editor_.StrokeTo(at));
  } else if (tuning_) {
    Tune(event->position());
  } else if (drawing_) {
    if (acts().gesture != Gesture::kPath) {
      drawing_->points.back() = at;
    } else if ((drawing_->points.back() - at).norm() * transform_.scale >= 1) {
      drawing_->points.push_back(at);
    }
    if (!HasCorners()) FindDrawn();
    update();
  }
  UpdateBrushOutline();
  Q_EMIT cursorMoved();
}

void SelectionCanvas::mouseReleaseEvent(QMouseEvent* event) {
  if (pan_from_ && !(event->buttons() & (Qt::RightButton | Qt::MiddleButton | Qt::LeftButton))) {
    pan_from_.reset();
    UpdateCursor();
    return;
  }
  if (event->button() != Qt::LeftButton) return;
  if (std::exchange(tuning_, std::nullopt)) Q_EMIT hintChanged();
  if (editor_.InStroke()) {
    editor_.EndStroke();
    ChooseOverlayColor();
    Q_EMIT edited();
  } else if (drawing_ && !HasCorners()) {
    FinishDrawing();
  }
}

void SelectionCanvas::mouseDoubleClickEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton && HasCorners()) {
    FinishDrawing();  // the press before has set the last corner here
    return;
  }
  mousePressEvent(event);
}

// --- Zoom and pan --------------------------------------------------------------------------------

void SelectionCanvas::FitView() {
  fitted_ = true;
  transform_ = ImageTransform::Fit({image_.width(), image_.height()}, {width(), height()});
  Moved();
}

void SelectionCanvas::ActualSize() {
  ZoomTo(QPointF(width() / 2.0, height() / 2.0), 1 / devicePixelRatioF());
}

void SelectionCanvas::ZoomTo(const QPointF& at, double scale) {
  fitted_ = false;
  transform_.ZoomAt(ToEigen(at), std::clamp(scale, kLeastScale, kMostScale));
  Moved();
}

void SelectionCanvas::Moved() {
  transform_.KeepVisible({image_.width(), image_.height()}, {width(), height()}, kMargin);
  update();
  Q_EMIT cursorMoved();
}

void SelectionCanvas::resizeEvent(QResizeEvent*) {
  if (fitted_) {
    FitView();
  } else {
    Moved();
  }
}

void SelectionCanvas::wheelEvent(QWheelEvent* event) {
  // With Alt, Qt reports the wheel as horizontal.
  const QPoint angle = event->angleDelta();
  const int delta = angle.y() != 0 ? angle.y() : angle.x();
  event->accept();
  if (event->modifiers().testFlag(Qt::AltModifier)) {
    wheel_rest_ += delta / 120.0;
    const int steps = static_cast<int>(wheel_rest_);
    wheel_rest_ -= steps;
    if (steps != 0) ScaleBrush(steps);
    return;
  }
  ZoomTo(event->position(), transform_.scale * std::pow(1.2, delta / 120.0));
  cursor_ = event->position();
  UpdateBrushOutline();
}

// --- Keys --------------------------------------------------------------------------------------

bool SelectionCanvas::WantsKey(const QKeyEvent& event) const {
  const SelectionKey* key = FindSelectionKey(event);
  return key && (key->act != SelectionAct::kTakeBack || drawing_);
}

bool SelectionCanvas::HandleKey(const QKeyEvent& event) {
  if (!WantsKey(event)) return false;
  const SelectionKey* key = FindSelectionKey(event);
  switch (key->act) {
    case SelectionAct::kRun:
      if (ready_ && paintable_) key->run(*this);
      break;
    case SelectionAct::kAccept:
      if (HasCorners()) {
        if (!event.isAutoRepeat()) FinishDrawing();
      } else if (!event.isAutoRepeat() && !drawing_ && !tuning_ && !editor_.InStroke()) {
        Q_EMIT acceptRequested();
      }
      break;
    case SelectionAct::kLeave:
      // Leaves the drawing, then the tool, then the mode.
      if (CancelDrawing()) break;
      if (paintable_ && tool_ != &SelectionTools().front()) {
        SetTool(SelectionTools().front());
      } else {
        Q_EMIT leaveRequested();
      }
      break;
    case SelectionAct::kPan:
      if (!event.isAutoRepeat()) space_ = true;
      UpdateCursor();
      break;
    case SelectionAct::kHideOverlay:
      overlay_hidden_ = true;
      update();
      break;
    case SelectionAct::kTakeBack:
      if (drawing_->points.size() > 2) {
        drawing_->points.erase(drawing_->points.end() - 2);
        FindDrawn();
        Q_EMIT hintChanged();
        update();
      } else {
        CancelDrawing();
      }
      break;
  }
  return true;
}

bool SelectionCanvas::event(QEvent* event) {
  // While the user paints, the window's shortcuts (undo, tools) are for the mask.
  if (event->type() == QEvent::ShortcutOverride && WantsKey(*static_cast<QKeyEvent*>(event))) {
    event->accept();
    return true;
  }
  return QWidget::event(event);
}

void SelectionCanvas::keyPressEvent(QKeyEvent* event) {
  modifiers_ = event->modifiers();
  if (!HandleKey(*event)) QWidget::keyPressEvent(event);
  UpdateBrushOutline();
}

void SelectionCanvas::keyReleaseEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Space && !event->isAutoRepeat()) {
    space_ = false;
    UpdateCursor();
  } else if (event->key() == Qt::Key_Backslash && !event->isAutoRepeat()) {
    overlay_hidden_ = false;
    update();
  } else {
    QWidget::keyReleaseEvent(event);
  }
  modifiers_ = event->modifiers();
  UpdateBrushOutline();
}

void SelectionCanvas::leaveEvent(QEvent*) {
  cursor_.reset();
  UpdateBrushOutline();
  Q_EMIT cursorMoved();
}

void SelectionCanvas::focusOutEvent(QFocusEvent* event) {
  // Key releases go to another widget from here on.
  space_ = false;
  if (std::exchange(overlay_hidden_, false)) update();
  UpdateCursor();
  QWidget::focusOutEvent(event);
}

}  // namespace retint
