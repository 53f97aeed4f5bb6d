// SPDX-License-Identifier: BSD-3-Clause
// A thread with a Renderer of its own (the backend is shared) that turns camera and coefficients
// into pictures. The newest request wins, older ones that have not begun are dropped. While the
// camera or the colors move a frame is rendered as small as it must be to come in time, judged by
// the frames before it; a frame at rest is sharp.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <QImage>
#include <QObject>

#include "render/renderer.h"
#include "viewer/scene/scene_controller.h"

namespace retint {

// Surfaces that are drawn hatched: where `shares`, [N] in [0, 1], blend to a fifth and more.
struct Hatching {
  std::shared_ptr<const std::vector<float>> shares;
  double pixels = 10;  // from line to line, of the sharp frame
};

enum class RenderWhat { kRgb, kDepth };

// The selected cloud as it is drawn: depth-tested squares of the screen.
struct OverlayCloud {
  std::vector<Eigen::Vector3f> points;  // world
  std::array<uint8_t, 3> color = {255, 170, 0};
  double opacity = 0.6;
  double quad_pixels = 2;  // of the sharp frame
  double depth_tolerance = 0.02;
};

struct FrameRequest {
  uint64_t serial = 0;                      // comes back with the frame
  PosedCamera camera;                       // size and intrinsics of the sharp frame
  std::shared_ptr<const LensPicture> lens;  // of `camera` where that is not pinhole, else null
  RenderWhat what = RenderWhat::kRgb;
  bool moving = false;                        // soon rather than sharp
  ShPointer sh;                               // null: those of the frame before
  ActivePointer sh_active;                    // of `sh`, see SceneColors::sh_active()
  ShPointer before;                           // also render these, for the split slider; null: no
  std::shared_ptr<const OverlayCloud> cloud;  // null: none
  std::optional<Hatching> hatching;           // none: nothing is hatched
};

// What the depth under the cursor is asked for: the camera turns to it, or a drag turns about it.
enum class ProbeFor { kFocus, kPivot };

struct Frame {
  QImage image;   // RGB32, the camera's size times `scale`; through a lens, the camera's size
  QImage before;  // of FrameRequest::before, else null
  uint64_t serial = 0;
  PosedCamera camera;  // as requested
  RenderWhat what = RenderWhat::kRgb;
  bool moving = false;
  double scale = 1;         // of width and height; 1: sharp
  double milliseconds = 0;  // it took
  ShPointer sh;
};

class RenderThread : public QObject {
  Q_OBJECT

 public:
  explicit RenderThread(QObject* parent = nullptr);
  ~RenderThread() override;

  // Shows another scene, or (null) none. Uploading happens on the thread; requests that came before
  // are dropped.
  void SetScene(std::shared_ptr<const SceneFacts> facts);
  void Request(const FrameRequest& request);
  // Depth at a pixel of `camera`: probed() follows. Cheap: a few pixels are rendered.
  void Probe(const PosedCamera& camera, const Eigen::Vector2d& pixel, ProbeFor what);

  // Frames while moving are held below this, milliseconds.
  void SetFrameBudget(double milliseconds);

 Q_SIGNALS:  // emitted on the thread that owns this object
  void frameReady(std::shared_ptr<const retint::Frame> frame);
  // `depth` 0: nothing there.
  void probed(const retint::PosedCamera& camera, const Eigen::Vector2d& pixel,
              retint::ProbeFor what, double depth);
  void failed(const QString& message);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// `camera` rendered at `scale` of its size, both at least one pixel; intrinsics follow the rounded
// size.
PosedCamera Scaled(const PosedCamera& camera, double scale);
// An image as Qt wants it, clamped and rounded.
QImage ToQImage(const Image& image);
QImage ToQImage(const Image8& image);
QImage ToQImage(const Mask& mask);

}  // namespace retint
