// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_canvas.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QWheelEvent>

#include "viewer/contrast.h"
#include "viewer/selection/selection_keys.h"

namespace retint {
namespace {

constexpr uint8_t kInsideMask = 128;
constexpr double kLeastScale = 0.05, kMostScale = 64;
constexpr double kLeastRadius = 0.5, kMostRadius = 500;
constexpr double kClosing = 10;  // widget pixels within which a click closes the polygon
constexpr double kMargin = 60;   // widget pixels of the image that stay visible

Eigen::Vector2d ToEigen(const QPointF& point) { return {point.x(), point.y()}; }

Image8 ToPixels(const QImage& image) {
  Image8 pixels(image.width(), image.height());
  const QImage rgb = image.convertToFormat(QImage::Format_RGB888);
  for (int y = 0; y < pixels.height; ++y) {
    std::copy_n(rgb.constScanLine(y), 3 * pixels.width, &pixels(0, y));
  }
  return pixels;
}

}  // namespace

SelectionCanvas::SelectionCanvas(QWidget* parent) : QWidget(parent) {
  setObjectName("selectionCanvas");
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setAttribute(Qt::WA_OpaquePaintEvent);
  setMinimumSize(160, 120);
  setAccessibleName(tr("Selection view"));
  UpdateCursor();
}

void SelectionCanvas::SetView(const QImage& image, DepthMap depth, Mask mask) {
  CancelDrawing();
  const bool same_size = image.size() == image_.size();
  image_ = image.convertToFormat(QImage::Format_RGB32);
  pixels_ = ToPixels(image_);
  depth_ = std::move(depth);
  editor_.Reset(std::move(mask));
  ready_ = true;
  if (!same_size || fitted_) FitView();
  ChooseOverlayColor();
  UpdateCursor();
  update();
  Q_EMIT edited();
}

void SelectionCanvas::ShowPicture(const QImage& image) {
  CancelDrawing();
  ready_ = false;
  image_ = image.convertToFormat(QImage::Format_RGB32);
  pixels_ = {};
  depth_ = {};
  editor_.Reset(Mask());
  FitView();
  UpdateCursor();
  Q_EMIT edited();
}

void SelectionCanvas::Edited(const PixelRect& changed) {
  if (!changed.Empty()) update(WidgetRect(changed));
  if (!editor_.InStroke()) ChooseOverlayColor();
  Q_EMIT edited();
}

// One that stands out from what is selected.
void SelectionCanvas::ChooseOverlayColor() {
  const Mask& mask = editor_.mask();
  if (mask.width != image_.width() || mask.height != image_.height()) return;
  const QColor under = MeanColor(image_, [&](int x, int y) { return mask(x, y) >= kInsideMask; });
  const QColor color = ContrastingColor(under, style_.color);
  if (color == style_.color) return;
  style_.color = color;
  update();
}

// --- Options -----------------------------------------------------------------------------------

void SelectionCanvas::SetTool(SelectionTool tool) {
  if (tool == tool_) return;
  CancelDrawing();
  tool_ = tool;
  UpdateCursor();
  UpdateBrushOutline();
  Q_EMIT optionsChanged();
}

void SelectionCanvas::SetBrush(const BrushOptions& brush) {
  brush_.radius = std::clamp(brush.radius, kLeastRadius, kMostRadius);
  brush_.hardness = std::clamp(brush.hardness, 0.0, 1.0);
  UpdateBrushOutline();
  Q_EMIT optionsChanged();
}

void SelectionCanvas::SetFlood(const FloodOptions& flood) {
  flood_ = flood;
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
  BrushOptions brush = brush_;
  // By a tenth, by at least half a pixel.
  for (int i = 0; i < std::abs(steps); ++i) {
    const double by = std::max(0.5, 0.1 * brush.radius);
    brush.radius = std::max(kLeastRadius, brush.radius + (steps > 0 ? by : -by));
  }
  SetBrush(brush);
}

// --- Operations --------------------------------------------------------------------------------

void SelectionCanvas::Undo() {
  if (drawing_ || flooding_) {
    CancelDrawing();
    return;
  }
  Edited(editor_.Undo());
}

void SelectionCanvas::Redo() {
  CancelDrawing();
  Edited(editor_.Redo());
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
  if (flooding_) {
    const Flooding flooding = *std::exchange(flooding_, std::nullopt);
    if (flooding.filled) Edited(editor_.Undo());
    flood_.tolerance = flooding.tolerance;
    Q_EMIT optionsChanged();
    return true;
  }
  if (!drawing_) return false;
  drawing_.reset();
  update();
  return true;
}

// --- Drawing -----------------------------------------------------------------------------------

Combine SelectionCanvas::CombineFor(Qt::KeyboardModifiers modifiers) const {
  if (tool_ == SelectionTool::kEraser) return Combine::kRemove;
  const bool shift = modifiers.testFlag(Qt::ShiftModifier);
  const bool control = modifiers.testFlag(Qt::ControlModifier);
  if (shift && control) return Combine::kIntersect;
  if (control) return Combine::kRemove;
  if (shift || tool_ == SelectionTool::kBrush) return Combine::kAdd;
  return Combine::kReplace;
}

Eigen::Vector2d SelectionCanvas::ImageAt(const QPointF& widget) const {
  return transform_.ToImage(ToEigen(widget));
}

void SelectionCanvas::Press(const Eigen::Vector2d& at, Qt::KeyboardModifiers modifiers) {
  const Combine combine = CombineFor(modifiers);
  if (IsBrush()) {
    Edited(editor_.BeginStroke(at, brush_, combine));
  } else if (tool_ == SelectionTool::kFlood) {
    flooding_ = Flooding{at, *cursor_, flood_.tolerance, combine};
    FloodAt(*cursor_);
  } else if (tool_ == SelectionTool::kPolygon && drawing_) {
    const double to_first = (drawing_->points.front() - at).norm() * transform_.scale;
    if (drawing_->points.size() > 3 && to_first < kClosing) {
      drawing_->points.pop_back();
      FinishDrawing();
      return;
    }
    drawing_->points.back() = at;
    drawing_->points.push_back(at);  // follows the cursor
    update();
  } else {
    drawing_ = Drawing{tool_, combine, {at, at}};
    update();
  }
}

void SelectionCanvas::FloodAt(const QPointF& cursor) {
  constexpr double kStep = 4;  // widget pixels a step of tolerance
  FloodOptions flood = flood_;
  flood.tolerance =
      std::clamp(flooding_->tolerance +
                     static_cast<int>(std::lround((cursor.x() - flooding_->from.x()) / kStep)),
                 0, 255);
  if (flooding_->filled && flood.tolerance == flood_.tolerance) return;
  PixelRect changed;
  if (flooding_->filled) changed = editor_.Undo();
  const PixelRect filled =
      editor_.Flood(pixels_, depth_, static_cast<int>(std::floor(flooding_->at.x())),
                    static_cast<int>(std::floor(flooding_->at.y())), flood, flooding_->combine);
  flooding_->filled = !filled.Empty();
  Edited(changed.United(filled));
  if (flood.tolerance != flood_.tolerance) SetFlood(flood);
}

void SelectionCanvas::FinishDrawing() {
  if (!drawing_) return;
  const Drawing drawing = *std::exchange(drawing_, std::nullopt);
  update();
  if (drawing.tool == SelectionTool::kRectangle) {
    Edited(editor_.FillRectangle(drawing.points.front(), drawing.points.back(), drawing.combine));
  } else {
    Edited(editor_.FillPolygon(drawing.points, drawing.combine));
  }
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
  } else if (flooding_) {
    FloodAt(event->position());
  } else if (drawing_ && drawing_->tool == SelectionTool::kLasso) {
    if ((drawing_->points.back() - at).norm() * transform_.scale >= 1) {
      drawing_->points.push_back(at);
      update();
    }
  } else if (drawing_) {
    drawing_->points.back() = at;
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
  flooding_.reset();
  if (editor_.InStroke()) {
    editor_.EndStroke();
    ChooseOverlayColor();
    Q_EMIT edited();
  } else if (drawing_ && drawing_->tool != SelectionTool::kPolygon) {
    FinishDrawing();
  }
}

void SelectionCanvas::mouseDoubleClickEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton && drawing_ && drawing_->tool == SelectionTool::kPolygon) {
    drawing_->points.pop_back();  // the press before this set the last corner here
    FinishDrawing();
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
  // With Alt, Qt turns the wheel sideways.
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
      if (drawing_ && drawing_->tool == SelectionTool::kPolygon) {
        drawing_->points.pop_back();
        FinishDrawing();
      } else if (!drawing_ && !flooding_ && !editor_.InStroke()) {
        Q_EMIT acceptRequested();
      }
      break;
    case SelectionAct::kLeave:
      // Out of what is drawn, then of the tool, then of the mode.
      if (CancelDrawing()) break;
      if (paintable_ && tool_ != SelectionTool::kBrush) {
        SetTool(SelectionTool::kBrush);
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
        update();
      } else {
        CancelDrawing();
      }
      break;
  }
  return true;
}

bool SelectionCanvas::event(QEvent* event) {
  // The window's shortcuts (undo, tools) mean the mask as long as one paints.
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
  // Keys that are let go elsewhere are not heard of here.
  space_ = false;
  if (std::exchange(overlay_hidden_, false)) update();
  UpdateCursor();
  QWidget::focusOutEvent(event);
}

}  // namespace retint
