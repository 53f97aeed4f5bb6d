// SPDX-License-Identifier: BSD-3-Clause
// The similarity between a splat and a workspace of one scene in different frames. Causes are tools
// that center, scale and turn the scene that they train (nerfstudio's dataparser, gsplat's
// normalize_world_space), and people who turn it later.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "colmap_io/workspace.h"
#include "kernels/backend.h"
#include "scene/camera.h"
#include "scene/gaussian_model.h"
#include "scene/image.h"

namespace retint {

struct AlignOptions {
  Sim3d given;             // how the splat is thought to lie, world from splat
  int views = 8;           // with photos, evenly spread, to compare renders with; twice as many
                           // without photos
  int longest_side = 320;  // pixels of these renders at the finest of three levels
};

struct AlignResult {
  Sim3d world_from_splat;
  std::string source;  // the start of the similarity: "identity", "given", a file, "points"
  // Mean PSNR of the renders against the photos, dB, as given and aligned; NaN without photos.
  double psnr_before = 0, psnr_after = 0;
};

struct ReducedPhoto {
  Image photo;
  Camera camera;
};
// Every pixel the mean of `step` x `step` of a pinhole camera's photo. Columns and rows that do not
// fill a pixel are cut off on the right and below.
ReducedPhoto Reduced(const Image& photo, const Camera& camera, int step);

// Files that may hold the similarity: dataparser_transforms.json beside the splat, in the
// workspace, or up to two folders above either.
std::vector<std::filesystem::path> FindTransformFiles(const std::filesystem::path& workspace,
                                                      const std::filesystem::path& splat);

// The starts are the splat's given frame, `files`, and the sparse points, registered to the
// Gaussians' centers (opening/point_registration.h). The one whose renders are most like the
// photos is refined, coarse to fine, by Levenberg-Marquardt on robust color differences.
// Their derivatives follow from the renders' gradients and depths (Lucas and Kanade 1981).
// Without photos, the first file or the best registration of the points is the start, and renders
// are compared with the colors of the sparse points at the pixels that saw them. InputError if
// there are neither points nor photos, or no start at which renders and photos have anything in
// common. Stages: "points", "align".
AlignResult Align(const std::shared_ptr<Backend>& backend, const Workspace& workspace,
                  const GaussianModel& model, const std::vector<std::filesystem::path>& files,
                  const AlignOptions& options, Monitor& monitor);

}  // namespace retint
