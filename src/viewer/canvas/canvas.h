// SPDX-License-Identifier: BSD-3-Clause
// The picture in the middle of the window: shows the pictures of the render thread, moves the
// camera, draws frusta, photo, split line and labels on top. Pixels that are rendered are device
// pixels.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <QElapsedTimer>
#include <QTimer>
#include <QWidget>

#include "viewer/canvas/navigation.h"
#include "viewer/canvas/photo_loader.h"
#include "viewer/canvas/render_thread.h"
#include "viewer/widgets/key_map.h"

namespace retint {

class Canvas : public QWidget {
  Q_OBJECT

 public:
  Canvas(SceneController* controller, RenderThread* renderer, PhotoLoader* photos,
         QWidget* parent = nullptr);

  // The camera. After a change through navigation() call CameraMoved().
  Navigation& navigation() { return navigation_; }
  const Navigation& navigation() const { return navigation_; }
  void CameraMoved();
  // The view or photo whose pixels are shown; null: the camera is free.
  const UserPicture* picture() const;
  bool GoTo(const std::string& name);  // of one, or of a view that it shows; false: there is none
  void StepView(int by);               // through the pictures by name, from the nearest one
  void FrameSelection();               // the cloud, else the scene
  void ResetCamera();

  // Choices of the picture.
  void SetDepth(bool depth);
  void SetFrusta(bool frusta);
  void SetSplit(bool split);
  void SetSplitAt(double at);  // share of the width that shows the scene before
  void SetFlyMode(bool fly);
  void SetCloud(std::shared_ptr<const OverlayCloud> cloud);  // null: none
  void SetCloudShown(bool shown);
  void SetCloudNote(const QString& note);  // beside the picture while the cloud shows; empty: none
  // Surfaces to hatch; null: none.
  void SetUncertain(std::shared_ptr<const std::vector<float>> shares);
  void SetHatching(bool hatching);
  // The picture on a camera's board if there is no photo, by the picture's name.
  void SetBoard(const std::string& name, const QImage& render);
  void SetHeld(const Command& command, bool down);  // photo, original, flying
  // The next click takes a color of the scene, which shows alone meanwhile, without depth, points
  // and hatching: picked(). Ends when the canvas is hidden.
  void SetPicking(bool picking);
  bool picking() const { return picking_; }
  bool depth() const { return what_ == RenderWhat::kDepth; }
  bool frusta() const { return frusta_; }
  bool split() const { return split_; }
  double split_at() const { return split_at_; }
  bool fly_mode() const { return fly_mode_; }
  // How much faster the keys that are held fly: 10 with Shift, 0.1 with Alt, else 1.
  double fly_factor() const { return fly_factor_; }
  bool hatching() const { return hatching_; }
  bool cloud_shown() const { return cloud_shown_; }
  QString CloudNote() const;  // empty: none shows
  bool showing_photo() const;
  // P is held, and the view's photo is missing or cannot be read.
  bool lacks_photo() const;
  bool showing_original() const { return original_; }

  std::shared_ptr<const Frame> frame() const { return frame_; }  // null before the first
  // Frames a second while moving; 0 before any.
  double frames_per_second() const { return frame_seconds_ > 0 ? 1 / frame_seconds_ : 0; }
  // The whole frame is on the screen, of this camera and these colors.
  bool IsSharp() const;
  // The part of the widget that a camera's picture fills.
  QRectF ImageRect(const PosedCamera& camera) const;
  // The view's name and special facts about the picture, in its corner.
  void PaintLabels(QPainter& painter) const;
  // How the picture of navigation().Rendered() is made; null: it is rendered.
  std::shared_ptr<const LensPicture> Lens() const;

  // The camera as a JSON object, for the session file. Restore: false when it is not one.
  std::string CameraState() const;
  bool RestoreCamera(const std::string& state);

 Q_SIGNALS:
  void cameraChanged();
  void frameShown();
  void stateChanged();  // depth, frusta, split, fly mode, cloud, hatching
  void hint(const QString& text);
  void menuWanted(const QPoint& at);  // on the screen
  void picked(const QColor& color);

 protected:
  bool event(QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void hideEvent(QHideEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void contextMenuEvent(QContextMenuEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;

 private:
  struct Frustum {
    const UserPicture* picture;
    QPointF apex;
    std::array<QPointF, 4> corners;
    double depth;
  };

  void OnScene();
  void OnSh();
  void OnFrame(std::shared_ptr<const Frame> frame);
  void Probe(const QPointF& at, ProbeFor what);
  void OnProbed(const PosedCamera& camera, const Eigen::Vector2d& pixel, ProbeFor what,
                double depth);
  void UpdateViewport();
  void Request(bool moving);
  void FlyStep();
  RenderWhat Shown() const;  // depth or colors
  bool ShowsSplit() const;   // split() where there are two sides: not of the depth
  void SayMissingPhoto();
  std::array<Eigen::Vector3d, 4> CornersOf(const UserPicture& picture) const;
  std::vector<Frustum> Frusta() const;
  const UserPicture* FrustumAt(const QPointF& at) const;
  void PaintFrusta(QPainter& painter) const;
  void PaintSplit(QPainter& painter, const QRectF& rect) const;
  void PaintPicked(QPainter& painter) const;
  QColor ColorAt(const QPointF& at) const;  // of the picture or the photo; invalid beside them
  bool OnSplitHandle(const QPointF& at) const;
  void UpdateCursor();

  SceneController* controller_;
  RenderThread* renderer_;
  PhotoLoader* photos_;
  std::shared_ptr<const SceneFacts> facts_;  // of the views that navigation_ knows; null: none
  Navigation navigation_;
  double frustum_size_ = 1;
  // Of the pictures of a camera: where they look, at depth 1.
  std::map<CameraId, std::array<Eigen::Vector3d, 4>> corners_;
  std::map<std::string, QImage> boards_;  // renders, see SetBoard()

  RenderWhat what_ = RenderWhat::kRgb;
  bool frusta_ = false, split_ = false, fly_mode_ = false, cloud_shown_ = true;
  QString cloud_note_;
  bool hatching_ = false;
  bool photo_ = false, original_ = false;
  double split_at_ = 0.5;
  std::shared_ptr<const OverlayCloud> cloud_;
  std::shared_ptr<const std::vector<float>> uncertain_;

  std::shared_ptr<const Frame> frame_;
  bool moving_ = false;
  uint64_t serial_ = 0;        // of the newest request
  uint64_t pick_from_ = 0;     // while picking_: of the first that shows the scene alone
  double frame_seconds_ = 0;   // between frames while moving, a running mean
  QElapsedTimer since_frame_;  // valid: since a frame of the movement that goes on

  std::optional<MouseGesture> gesture_;
  bool split_drag_ = false, picking_ = false;
  QPointF mouse_, pressed_;
  bool dragged_ = false;          // since the press
  std::set<std::string> flying_;  // held commands
  QTimer rest_, fly_, news_;
  bool more_news_ = false;  // the optimizer has published since the last frame
  QElapsedTimer fly_clock_;
  double fly_factor_ = 1;
};

}  // namespace retint
