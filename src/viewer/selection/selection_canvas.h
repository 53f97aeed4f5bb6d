// SPDX-License-Identifier: BSD-3-Clause
// The frozen view as an image editor: mouse and keys for a MaskEditor, zoom and pan, brush outline,
// overlay. It does not know scenes: it gets a picture, its layers and a mask; editor() has the
// result. Nor does it know tools: it carries out ToolActs. Slow searches run on another thread, and
// show their results when ready.
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

  // Starts again with a picture and its mask. `layers`: the same pixels for tools that find an
  // outline. Without depth, they use only color, and tools for solids select nothing.
  void SetView(const QImage& image, ViewLayers layers, Mask mask);
  // Only shows the picture while the view is being prepared; no painting.
  void ShowPicture(const QImage& image);
  bool HasView() const { return ready_; }

  MaskEditor& editor() { return editor_; }
  const MaskEditor& editor() const { return editor_; }
  SelectionVeil& veil() { return *veil_; }  // under the overlay
  // Hatches these pixels on top, in a color that stands out from the overlay; empty: none.
  void SetHatched(Mask where);
  const Mask& hatched() const { return hatched_; }
  // 255 in pixels that the outline of the strokes leaves open (MaskFromScribbles()), as long as the
  // outline is unchanged; null: none.
  std::shared_ptr<const Mask> undecided() const {
    return applied_ != 0 && applied_ == undecided_of_ ? undecided_ : nullptr;
  }
  // Repaints pixels that an edit changed, emits signals, and cancels searches. Every edit from
  // outside must call it.
  void Edited(const GridRect& changed);

  const SelectionTool& tool() const { return *tool_; }
  void SetTool(const SelectionTool& tool);  // of SelectionTools()
  // The brush of the current tool: scribbles have their own.
  const BrushOptions& brush() const { return IsScribble() ? outline_.scribble : brush_; }
  void SetBrush(const BrushOptions& brush);
  const OutlineOptions& outline() const { return outline_; }
  void SetOutline(const OutlineOptions& outline);
  // The network for the tool Object, as for MakeMaskNetwork(); empty: none.
  void SetNetwork(const std::string& name);
  // MaskNetwork::Identity() of the newest network whose outline was taken since SetView(), also
  // where strokes changed it later; empty if none was, or all was undone.
  std::string outlined_by() const { return editor_.CanUndo() ? outlined_by_ : std::string(); }
  double overlay_opacity() const { return style_.opacity; }
  void SetOverlayOpacity(double opacity);
  const QColor& overlay_color() const { return style_.color; }
  void SetPaintable(bool paintable);  // false: only looking, while the selection is computed

  const ImageTransform& transform() const { return transform_; }
  void FitView();
  void ActualSize();  // one image pixel is one widget pixel

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
  void RefineBorder();  // the whole border, within the brush's radius
  bool IsFinding() const { return finder_->IsBusy(); }
  QString Hint() const;  // the next step; "  ·  " separates parts that may be left out
  // Ends the current drawing without a change; false if there is none.
  bool CancelDrawing();

  // For tools.
  const ViewLayers& layers() const { return *layers_; }
  size_t NumCorners() const { return HasCorners() ? drawing_->points.size() - 1 : 0; }
  const std::vector<Scribble>& scribbles() const { return scribbles_; }
  void AddStroke(const Drawing& drawing);                        // to them
  void RefineAlong(const std::vector<Eigen::Vector2d>& stroke);  // empty: the whole border
  QString NetworkProblem();  // why there is no network; made on first use
  void NotFound(const QString& why);

  // Whether this key (with these modifiers) has a meaning here. HandleKey() executes it.
  bool WantsKey(const QKeyEvent& event) const;
  bool HandleKey(const QKeyEvent& event);

 Q_SIGNALS:
  void edited();
  void optionsChanged();  // tool, brush, outline, opacity
  void hintChanged();
  void findingChanged();  // IsFinding()
  void found();           // the result is shown
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
  const ToolActs& acts() const { return tool_->acts; }
  bool IsBrush() const { return acts().gesture == Gesture::kBrush; }
  bool IsScribble() const { return acts().has_tip && acts().keeps_strokes; }
  bool HasCorners() const { return drawing_ && acts().gesture == Gesture::kCorners; }
  void Press(const Eigen::Vector2d& at, Qt::KeyboardModifiers modifiers);
  void FinishDrawing();
  void Changed(const GridRect& changed);
  // selection_canvas_outline.cc
  void Find(uint64_t gesture, Combine combine, OutlineFinder::Work work);
  void Tune(const QPointF& cursor);
  void FindDrawn();  // finds the outline of the drawing so far
  void FindScribbled();
  void UndoScribble();
  void RedoScribble();
  void ForgetScribbles();
  void UpdateCursor();
  void UpdateBrushOutline();
  void ZoomTo(const QPointF& at, double scale);
  void Moved();  // transform_ has changed
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
  const SelectionTool* tool_ = &SelectionTools().front();
  BrushOptions brush_;
  OutlineOptions outline_;
  OverlayStyle style_;
  bool overlay_hidden_ = false;
  std::optional<Drawing> drawing_;
  std::optional<Tuning> tuning_;
  std::string network_name_;
  std::shared_ptr<const MaskNetwork> network_;
  std::vector<Scribble> scribbles_, undone_;  // undone_: the newest first
  Mask under_scribbles_;                      // the mask before the scribbles; may be empty
  uint64_t gesture_ = 0;                      // the newest one
  uint64_t applied_ = 0;                      // gesture of the newest step of the history
  std::shared_ptr<const Mask> undecided_;
  uint64_t undecided_of_ = 0;                      // gesture of the outline that leaves it open
  std::shared_ptr<const std::string> network_of_;  // of that outline; empty: none took part
  std::string outlined_by_;
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
