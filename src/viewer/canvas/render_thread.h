// SPDX-License-Identifier: BSD-3-Clause
// A thread that renders pictures of a camera and coefficients, with its own Renderer and the shared
// backend. The newest request wins; older requests that have not begun are dropped. While the
// camera or the colors move, frames are small enough to come in time, judged by earlier ones. Then
// a sharp one follows.
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

// Hatches surfaces for which `shares`, [N] in [0, 1], blend to at least 0.2.
struct Hatching {
  std::shared_ptr<const std::vector<float>> shares;
  double pixels = 10;  // between lines, in the sharp frame
};

enum class RenderWhat { kRgb, kDepth };

// The selected cloud, drawn as depth-tested squares.
struct OverlayCloud {
  std::vector<Eigen::Vector3f> points;  // world
  std::array<uint8_t, 3> color = {255, 170, 0};
  double opacity = 0.6;
  double quad_pixels = 2;  // in the sharp frame
  double depth_tolerance = 0.02;
};

struct FrameRequest {
  uint64_t serial = 0;                      // is returned with the frame
  PosedCamera camera;                       // size and intrinsics of the sharp frame
  std::shared_ptr<const LensPicture> lens;  // of `camera` if that is not a pinhole, else null
  RenderWhat what = RenderWhat::kRgb;
  bool moving = false;                        // soon is better than sharp
  ShPointer sh;                               // null: those of the previous frame
  ActivePointer sh_active;                    // of `sh`, see SceneColors::sh_active()
  ShPointer before;                           // rendered too, for the split slider; null: not
  std::shared_ptr<const OverlayCloud> cloud;  // null: none
  std::optional<Hatching> hatching;           // none: no hatching
};

// The use of a depth under the cursor: the camera turns to it, or a drag turns about it.
enum class ProbeFor { kFocus, kPivot };

struct Frame {
  QImage image;   // RGB32, the camera's size times `scale`; with a lens, the camera's size
  QImage before;  // of FrameRequest::before, else null
  uint64_t serial = 0;
  PosedCamera camera;  // as requested
  RenderWhat what = RenderWhat::kRgb;
  bool moving = false;
  double scale = 1;         // of width and height; 1: sharp
  double milliseconds = 0;  // to render it
  ShPointer sh;
};

class RenderThread : public QObject {
  Q_OBJECT

 public:
  explicit RenderThread(QObject* parent = nullptr);
  ~RenderThread() override;

  // Shows another scene, or none (null). The thread uploads it. Drops earlier
  // requests.
  void SetScene(std::shared_ptr<const SceneFacts> facts);
  void Request(const FrameRequest& request);
  // Asks for the depth at a pixel of `camera`; probed() answers. Renders only a few pixels.
  void Probe(const PosedCamera& camera, const Eigen::Vector2d& pixel, ProbeFor what);

  // Limits the time per frame while moving, in milliseconds.
  void SetFrameBudget(double milliseconds);

 Q_SIGNALS:  // emitted on the thread that owns this object
  void frameReady(std::shared_ptr<const retint::Frame> frame);
  // `depth` 0: nothing is there.
  void probed(const retint::PosedCamera& camera, const Eigen::Vector2d& pixel,
              retint::ProbeFor what, double depth);
  void failed(const QString& message);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// `camera` at `scale` of its size, at least one pixel wide and high. Intrinsics fit the rounded
// size.
PosedCamera Scaled(const PosedCamera& camera, double scale);
// An image in Qt's format, clamped and rounded.
QImage ToQImage(const Image& image);
QImage ToQImage(const Image8& image);
QImage ToQImage(const Mask& mask);

}  // namespace retint
