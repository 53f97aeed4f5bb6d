// SPDX-License-Identifier: BSD-3-Clause
// The frozen view as an image editor: mouse and keys to a MaskEditor, zoom and pan, brush outline,
// overlay. Knows nothing of scenes: a picture, its layers and a mask come in, the mask is read off
// editor(). Slow searches run on another thread, and show when they are done.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QImage>
#include <QPoint>
#include <QWidget>

#include "viewer/selection/image_transform.h"
#include "viewer/selection/mask_editor.h"
#include "viewer/selection/mask_overlay.h"
#include "viewer/selection/outline_finder.h"
#include "viewer/selection/selection_tools.h"
#include "viewer/selection/selection_veil.h"

class QKeyEvent;

namespace retint {

class MaskNetwork;

class SelectionCanvas : public QWidget {
  Q_OBJECT

 public:
  explicit SelectionCanvas(QWidget* parent = nullptr);

  // Starts anew with a picture and the mask on it. `layers`: the same pixels, as the tools that
  // find an outline see them; without depth, color alone decides, and solids select nothing.
  void SetView(const QImage& image, ViewLayers layers, Mask mask);
  // Only the picture, while the view itself is on its way: nothing can be painted.
  void ShowPicture(const QImage& image);
  bool HasView() const { return ready_; }

  MaskEditor& editor() { return editor_; }
  const MaskEditor& editor() const { return editor_; }
  SelectionVeil& veil() { return *veil_; }  // under the overlay
  // Laid over everything in lines, in a color that stands out from the overlay's; no pixels: none.
  void SetHatched(Mask where);
  const Mask& hatched() const { return hatched_; }
  // Pixels that the outline of the strokes leaves open (MaskFromScribbles()), 255, as long as it
  // shows as it was found; null: none.
  std::shared_ptr<const Mask> undecided() const {
    return applied_ != 0 && applied_ == undecided_of_ ? undecided_ : nullptr;
  }
  // Repaints what an edit changed and tells everyone; what is still being found is given up. Every
  // edit made from outside ends here.
  void Edited(const GridRect& changed);

  SelectionTool tool() const { return tool_; }
  void SetTool(SelectionTool tool);
  // Of the tool at hand: scribbles have a brush of their own.
  const BrushOptions& brush() const { return IsScribble() ? outline_.scribble : brush_; }
  void SetBrush(const BrushOptions& brush);
  const OutlineOptions& outline() const { return outline_; }
  void SetOutline(const OutlineOptions& outline);
  // Which network the tool Object asks, as MakeMaskNetwork() takes it; empty: none.
  void SetNetwork(const std::string& name);
  bool HasTip() const;  // the tool paints with brush()
  double overlay_opacity() const { return style_.opacity; }
  void SetOverlayOpacity(double opacity);
  const QColor& overlay_color() const { return style_.color; }
  void SetPaintable(bool paintable);  // false: looks only, while the selection is computed

  const ImageTransform& transform() const { return transform_; }
  void FitView();
  void ActualSize();  // one image pixel a widget pixel

  // Actions of both keys and buttons.
  bool CanUndo() const { return editor_.CanUndo() || !scribbles_.empty(); }
  bool CanRedo() const { return editor_.CanRedo() || !undone_.empty(); }
  void Undo();
  void Redo();
  void GrowBy(int pixels);  // negative: shrinks
  void Invert();
  void SelectAll();
  void SelectNone();
  void ScaleBrush(int steps);
  void RefineBorder();  // all of it, within the brush's radius
  bool IsFinding() const { return finder_->IsBusy(); }
  QString Hint() const;  // what to do next; parts that may be left out are set apart by "  ·  "
  // Ends the current drawing without a change. False when there was nothing.
  bool CancelDrawing();
  // Whether this key (with these modifiers) means something here; HandleKey does it.
  bool WantsKey(const QKeyEvent& event) const;
  bool HandleKey(const QKeyEvent& event);

 Q_SIGNALS:
  void edited();
  void optionsChanged();  // tool, brush, outline, opacity
  void hintChanged();
  void findingChanged();  // IsFinding()
  void found();           // the result shows
  void notFound(const QString& why);
  void cursorMoved();
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
  bool IsBrush() const { return tool_ == SelectionTool::kBrush || tool_ == SelectionTool::kEraser; }
  bool IsScribble() const { return tool_ == SelectionTool::kScribble; }
  bool HasCorners() const;  // the drawing is set corner by corner
  Combine CombineFor(Qt::KeyboardModifiers modifiers) const;
  void Press(const Eigen::Vector2d& at, Qt::KeyboardModifiers modifiers);
  void FinishDrawing();
  void Changed(const GridRect& changed);
  // selection_canvas_outline.cc
  void Find(uint64_t gesture, Combine combine, OutlineFinder::Work work);
  void NotFound(const QString& why);
  void Tune(const QPointF& cursor);
  void FindDrawn();  // the meaning of the drawing so far
  void FindScribbled();
  void FindRefined(const std::vector<Eigen::Vector2d>& stroke);  // empty: everywhere
  void AddScribble(const Drawing& drawing);
  bool HasNetwork();  // made when it is first needed; if not, says why
  void UndoScribble();
  void RedoScribble();
  void ForgetScribbles();
  std::optional<Eigen::Vector3d> SurfaceAt(const Eigen::Vector2d& at) const;  // in the world
  void UpdateCursor();
  void UpdateBrushOutline();
  void ZoomTo(const QPointF& at, double scale);
  void Moved();  // the transform
  void ChooseOverlayColor();
  QRect WidgetRect(const GridRect& rect) const;
  void PaintOverlay(class QPainter& painter, const QRect& clip);
  void PaintDrawing(class QPainter& painter) const;
  void PaintScribbles(class QPainter& painter) const;
  void PaintBrush(class QPainter& painter) const;
  Eigen::Vector2d ImageAt(const QPointF& widget) const;

  MaskEditor editor_;
  QImage image_;
  std::shared_ptr<const ViewLayers> layers_;
  bool ready_ = false, paintable_ = true;
  ImageTransform transform_;
  bool fitted_ = true;  // follows the widget's size
  SelectionTool tool_ = SelectionTool::kBrush;
  BrushOptions brush_;
  OutlineOptions outline_;
  OverlayStyle style_;
  bool overlay_hidden_ = false;
  std::optional<Drawing> drawing_;
  std::optional<Tuning> tuning_;
  std::string network_name_;
  std::shared_ptr<const MaskNetwork> network_;
  std::vector<Scribble> scribbles_, undone_;  // undone_: the newest first
  Mask under_scribbles_;                      // the mask that they add to; may be empty
  uint64_t gesture_ = 0;                      // the newest
  uint64_t applied_ = 0;                      // the newest step of the history is its result
  std::shared_ptr<const Mask> undecided_;
  uint64_t undecided_of_ = 0;  // which gesture's outline leaves that open
  Mask hatched_;
  OutlineFinder* finder_;
  SelectionVeil* veil_;
  std::optional<QPointF> cursor_;  // over the widget
  Qt::KeyboardModifiers modifiers_;
  std::optional<QPointF> pan_from_;
  bool space_ = false;
  QRect brush_rect_;  // where the outline was painted
  double wheel_rest_ = 0;
};

}  // namespace retint
