// SPDX-License-Identifier: BSD-3-Clause
// A distorted photo as pinhole pictures, its faces: one where the photo's field is at most 112
// degrees wide and high, else those faces of a cube about the camera that the photo sees, 96
// degrees wide and high each. Faces have the photo's resolution in its middle or, where the photo
// is finer elsewhere, up to half more. Positions are in pixels, centers at (0.5, 0.5).
#pragma once

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

// InputError, without a file, for parameters that no lens has (CameraProjection) or whose
// distortion folds the picture: less than a third of its pixels have a ray.
Undistortion Undistort(const Camera& photo);

// "OPENCV 640x480, undistorted to 702x520": the model, the size and what is shown of it. Tells the
// fault of a camera that cannot be undistorted.
std::string DescribeCamera(const Camera& camera);

// Where the pixels of one picture lie in another; NaN where they do not.
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
