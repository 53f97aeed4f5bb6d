// SPDX-License-Identifier: BSD-3-Clause
// A distorted photo as pinhole pictures, its faces. It has one if the photo's field is at most 112
// degrees wide and high. Else the faces are those of a cube about the camera that the photo sees,
// each 96 degrees wide and high. Faces have the resolution of the photo's middle, or up to half
// more if the photo is finer elsewhere. Positions are in pixels, centers at (0.5, 0.5).
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "scene/camera.h"

namespace retint {

struct PinholeFace {
  std::string name;  // "front", "right", "back", "left", "up", "down"; empty for the only one
  Camera camera;     // PINHOLE; no id
  Eigen::Quaterniond face_from_photo = Eigen::Quaterniond::Identity();  // a turn about the center
};

struct Undistortion {
  Camera photo;
  std::vector<PinholeFace> faces;

  // Photos that take several faces see so much that z is no depth: theirs is the distance along the
  // ray.
  bool DepthIsDistance() const { return faces.size() > 1; }
};

// The weight of a face in a photo's pixel, which the face shows at (x, y), relative to the other
// faces that show it. It is less near the face's border, so that overlapping faces fade into each
// other. Above 0, at most 1.
inline float FaceWeight(const Undistortion& undistortion, size_t face, float x, float y) {
  constexpr float kFade = 0.05F;   // of a face's longer side, from its border
  constexpr float kLeast = 1e-4F;  // at the very border a face that sees the pixel alone counts
  if (undistortion.faces.size() == 1) return 1;
  const Camera& camera = undistortion.faces[face].camera;
  const auto width = float(camera.width), height = float(camera.height);
  const float border = std::min({x, y, width - x, height - y});
  return std::clamp(border / (kFade * std::max(width, height)), kLeast, 1.0F);
}

// InputError, without a file, for parameters that no lens has (CameraProjection) or whose
// distortion folds the picture: less than a third of its pixels have a ray.
Undistortion Undistort(const Camera& photo);

// "OPENCV 640x480, undistorted to 702x520": the model, the size and the size of the shown part.
// Tells the fault of a camera that cannot be undistorted.
std::string DescribeCamera(const Camera& camera);

// The places of one picture's pixels in another; NaN for a pixel that is not in it.
struct PixelMap {
  int width = 0, height = 0;
  std::vector<float> xy;  // [height, width, 2]
};

// Of a face's pixels in the photo. `width` and `height` other than the face's sample it coarsely.
PixelMap PhotoFromFace(const Undistortion& undistortion, size_t face);
PixelMap PhotoFromFace(const Undistortion& undistortion, size_t face, int width, int height);
// Of the photo's pixels in a face.
PixelMap FaceFromPhoto(const Undistortion& undistortion, size_t face);

// The face that sees the ray of a photo (in its camera's frame) nearest to its middle, and the
// pixel there; -1 for none.
int BestFace(const Undistortion& undistortion, const Eigen::Vector3d& ray, Eigen::Vector2d* pixel);

}  // namespace retint
