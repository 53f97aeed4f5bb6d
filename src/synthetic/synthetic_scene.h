// SPDX-License-Identifier: BSD-3-Clause
// Sample scenes with exact ground truth: photos, depth, object ids, a sparse reconstruction and
// Gaussians of one analytic, ray-traced world. World frame as COLMAP's captures usually come: x
// right, y down, z away from the viewer; meters.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/monitor.h"
#include "base/option.h"
#include "scene/gaussian_model.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// An object and the display-encoded color, 0 to 1, of its surface; or a picture on every side of
// its body.
struct PaintedObject {
  std::string object;
  std::array<float, 3> color = {};
  Image8 picture = {};  // where not empty, instead of the color
};

struct SyntheticOptions {
  int width = 640, height = 480;  // pixels
  int views = 24;                 // on an arc about the table
  bool around = false;            // all around it, in the open: no walls
  // The Gaussians are as small as photos of `detail` times the size would show.
  int detail = 1;
  uint64_t seed = 0;
  double point_noise = 0.5;  // pixels, standard deviation of the sparse points' observations
  int sparse_points = 6000;  // at most; small images carry fewer
  // Flaws of the Gaussians, which slide along the lines of sight from the middle of the cameras, so
  // that the splat looks right from there. Shares of the distance.
  double wall_bias = 0.04;        // largest, smooth, on textureless walls only
  double depth_wave = 0;          // largest, smooth over every surface
  double depth_noise = 0;         // standard deviation, of every Gaussian by itself
  int floaters = 120;             // stray Gaussians in free space
  double floater_opacity = 0.06;  // of the most opaque one
  // Flaws of the sparse points: scaled about the middle of the cameras, then moved by this many
  // meters, to the right and away from the viewer alike. Cameras, photos and Gaussians stay.
  double cloud_scale = 1, cloud_shift = 0;
  bool bare_walls = false;  // no wallpaper: two walls without texture, and no points on them
  // Objects of another color; a pattern stays as shades of it, light and gloss stay as they are.
  std::vector<PaintedObject> albedo;
  void Describe(OptionList& list);  // all but the seed and the colors
  void Check() const;               // throws OptionError
};

struct SyntheticView {
  std::string name;                   // "000.png", the view's name in the reconstruction
  Image photo;                        // anti-aliased, display encoded, in [0, 1]
  DepthMap depth;                     // exact z of the surface at the pixel center; 0 where none
  PixelArray<uint8_t, 1> object_ids;  // at the pixel center; 0 background
  PixelArray<float, 3> normals;       // world, unit, towards the camera, at the pixel center
};

struct SyntheticScene {
  Reconstruction reconstruction;
  GaussianModel model;                    // degree 3, in the reconstruction's frame
  std::vector<SyntheticView> views;       // by name
  std::vector<std::string> object_names;  // index = id; 0 is "background"
  // Of every object, the views that see it whole: next to nothing (3 %) in front of it, nothing cut
  // off by the image's border. Always empty for objects that are not in `still_life`.
  std::vector<std::vector<int>> whole_views;
  // Objects meant to be selected (not the room, the table, ...): each has at least one whole view
  // at the default options.
  std::vector<int> still_life;
};

// Deterministic in the options alone: the same bytes on any number of threads. Stages reported:
// "light", "photos", "gaussians", "points".
SyntheticScene MakeSyntheticScene(const SyntheticOptions& options, Monitor& monitor);

// A camera of the model of that name, with a distortion as strong as real lenses have, whose field
// holds that of the pinhole `camera`. It has the same focal length in the middle and the same size;
// only EQUIRECTANGULAR pictures are four times as wide and half as high as that. OptionError for
// models other than SIMPLE_RADIAL, OPENCV, OPENCV_FISHEYE and EQUIRECTANGULAR.
Camera MakeLens(std::string_view model, const Camera& camera);

// Takes the photos of `scene`, made by MakeSyntheticScene(options), again through a lens whose
// field holds that of the scene's camera. It replaces camera, photos, depth (the distance along the
// ray for EQUIRECTANGULAR), object ids, normals and observations. The Gaussians, the points and the
// poses stay.
void TakeThroughLens(Camera lens, const SyntheticOptions& options, SyntheticScene* scene,
                     Monitor& monitor);

}  // namespace retint
