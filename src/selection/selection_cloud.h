// SPDX-License-Identifier: BSD-3-Clause
// The 3D selection: painted pixels unprojected with their depth, without outliers. It grows and
// shrinks over rounds of painting.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/monitor.h"
#include "base/option.h"
#include "kernels/backend.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

struct SelectionPoint {
  Eigen::Vector3f position;  // world
  Eigen::Vector3f normal;    // world, unit, toward the camera that saw the point
  float footprint = 0;       // world size of one source pixel there, z / f
  float confidence = 1;      // 1: depth measured; 0.5: filled in from the rough depth
  float coverage = 1;        // soft mask value of the source pixel in (0, 1]
  std::array<uint8_t, 3> color = {0, 0, 0};
  uint16_t source = 0;    // index into SelectionCloud::sources
  uint16_t x = 0, y = 0;  // source pixel
};

struct SelectionCloud {
  std::vector<SelectionPoint> points;
  std::vector<std::string> sources;  // names of painted views, in the order of painting
};

struct CloudOptions {
  double sample_fraction = 0.7;  // of the mask's pixels, chosen uniformly
  uint64_t seed = 0;
  int outlier_neighbors = 16;     // PCL StatisticalOutlierRemoval; 0 keeps all points
  double outlier_stddev = 0.007;  // factor on the standard deviation of the mean neighbor distance
  void Describe(OptionList& list);
  void Check() const;
};

struct CloudSummary {
  int64_t mask_pixels = 0, sampled = 0, kept = 0;
};

// Unprojects the painted pixels of one view to positions, normals (from the depth map's gradient),
// footprints and colors. `mask`, `depth`, `valid` (0/255; empty: all valid) and `image` (may be
// empty) need the view's size. `backend` (may be null) searches for neighbors if it can, with the
// same result. InputError for a size mismatch or an empty mask. NoDepthError if no pixel of the
// mask has depth.
SelectionCloud MakeCloud(const PosedCamera& view, const std::string& view_name, const Mask& mask,
                         const DepthMap& depth, const Mask& valid, const Image& image,
                         const CloudOptions& options, CloudSummary* summary = nullptr,
                         Backend* backend = nullptr);

// Sets the colors of the points from `rgb`, [H, W, 3], the image that all points come from.
void SetColors(const float* rgb, int width, SelectionCloud* cloud);

// Appends the points of `other`, with adapted source indices.
void Append(SelectionCloud& cloud, SelectionCloud other);

// Removes points that project into set pixels of `erase` and are not hidden behind `depth`
// (relative tolerance). Returns how many.
int64_t Erase(SelectionCloud& cloud, const PosedCamera& view, const Mask& erase,
              const DepthMap& depth, double depth_tolerance = 0.05);

// Binary .ply: x y z, nx ny nz, red green blue, footprint, confidence, coverage, source, px, py; a
// comment line for each source. ReadCloud() also reads clouds of other tools: any .ply with x y z,
// and optional normals, colors and footprints.
void WriteCloud(const std::filesystem::path& path, const SelectionCloud& cloud);
SelectionCloud ReadCloud(const std::filesystem::path& path);

}  // namespace retint
