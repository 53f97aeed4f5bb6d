// SPDX-License-Identifier: BSD-3-Clause
// The frozen view as an image editor: mouse and keys to a MaskEditor, zoom and pan, brush outline,
// overlay. Knows nothing of scenes: a picture, its depth and a mask come in, the mask is read off
// editor().
#pragma once

#include <optional>
#include <vector>

#include <QImage>
#include <QPoint>
#include <QWidget>

#include "viewer/selection/image_transform.h"
#include "viewer/selection/mask_editor.h"
#include "viewer/selection/mask_overlay.h"

class QKeyEvent;

namespace retint {

enum class SelectionTool { kBrush, kEraser, kRectangle, kLasso, kPolygon, kFlood };

class SelectionCanvas : public QWidget {
  Q_OBJECT

 public:
  explicit SelectionCanvas(QWidget* parent = nullptr);

  // Starts anew with a picture and the mask on it. `depth` bounds the flood; may have no pixels.
  void SetView(const QImage& image, DepthMap depth, Mask mask);
  // Only the picture, while the view itself is on its way: nothing can be painted.
  void ShowPicture(const QImage& image);
  bool HasView() const { return ready_; }

  MaskEditor& editor() { return editor_; }
  const MaskEditor& editor() const { return editor_; }
  // Repaints what an edit changed and tells everyone. Every edit() made from outside ends here.
  void Edited(const PixelRect& changed);

  SelectionTool tool() const { return tool_; }
  void SetTool(SelectionTool tool);
  const BrushOptions& brush() const { return brush_; }
  void SetBrush(const BrushOptions& brush);
  const FloodOptions& flood() const { return flood_; }
  void SetFlood(const FloodOptions& flood);
  double overlay_opacity() const { return style_.opacity; }
  void SetOverlayOpacity(double opacity);
  const QColor& overlay_color() const { return style_.color; }
  void SetPaintable(bool paintable);  // false: looks only, while the selection is computed

  const ImageTransform& transform() const { return transform_; }
  void FitView();
  void ActualSize();  // one image pixel a widget pixel

  // What keys and buttons do alike.
  void Undo();
  void Redo();
  void GrowBy(int pixels);  // negative: shrinks
  void Invert();
  void SelectAll();
  void SelectNone();
  void ScaleBrush(int steps);
  // Ends what is being drawn without a change. False when there was nothing.
  bool CancelDrawing();
  // Whether this key (with these modifiers) means something here; HandleKey does it.
  bool WantsKey(const QKeyEvent& event) const;
  bool HandleKey(const QKeyEvent& event);

 Q_SIGNALS:
  void edited();
  void optionsChanged();  // tool, brush, flood, opacity
  void cursorMoved();     // hint() may be another
  void acceptRequested();
  void leaveRequested();

 protected:
  bool event(QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void leaveEvent(QEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  // Held while a shape is drawn; positions in the image.
  struct Drawing {
    SelectionTool tool;
    Combine combine;
    std::vector<Eigen::Vector2d> points;
  };
  // The flood follows the mouse until it is let go: to the right more, to the left less tolerance.
  struct Flooding {
    Eigen::Vector2d at;  // image
    QPointF from;        // widget
    int tolerance;       // at the press
    Combine combine;
    bool filled = false;  // the press is a step of the history
  };
  bool IsBrush() const { return tool_ == SelectionTool::kBrush || tool_ == SelectionTool::kEraser; }
  Combine CombineFor(Qt::KeyboardModifiers modifiers) const;
  void Press(const Eigen::Vector2d& at, Qt::KeyboardModifiers modifiers);
  void FinishDrawing();
  void FloodAt(const QPointF& cursor);
  void UpdateCursor();
  void UpdateBrushOutline();
  void ZoomTo(const QPointF& at, double scale);
  void Moved();  // the transform
  void ChooseOverlayColor();
  QRect WidgetRect(const PixelRect& rect) const;
  void PaintOverlay(class QPainter& painter, const QRect& clip);
  void PaintDrawing(class QPainter& painter) const;
  void PaintBrush(class QPainter& painter) const;
  Eigen::Vector2d ImageAt(const QPointF& widget) const;

  MaskEditor editor_;
  QImage image_;
  Image8 pixels_;
  DepthMap depth_;
  bool ready_ = false, paintable_ = true;
  ImageTransform transform_;
  bool fitted_ = true;  // follows the widget's size
  SelectionTool tool_ = SelectionTool::kBrush;
  BrushOptions brush_;
  FloodOptions flood_;
  OverlayStyle style_;
  bool overlay_hidden_ = false;
  std::optional<Drawing> drawing_;
  std::optional<Flooding> flooding_;
  std::optional<QPointF> cursor_;  // over the widget
  Qt::KeyboardModifiers modifiers_;
  std::optional<QPointF> pan_from_;
  bool space_ = false;
  QRect brush_rect_;  // where the outline was painted
  double wheel_rest_ = 0;
};

}  // namespace retint
