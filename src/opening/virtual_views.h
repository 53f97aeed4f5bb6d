// SPDX-License-Identifier: BSD-3-Clause
// Views for a splat that comes without photos: cameras placed so that every visible Gaussian is
// seen well from several sides. They take the place of a COLMAP workspace's views: renders are
// their pictures.
#pragma once

#include <filesystem>
#include <memory>

#include "base/monitor.h"
#include "colmap_io/workspace.h"
#include "kernels/backend.h"
#include "scene/gaussian_model.h"

namespace retint {

struct VirtualViewOptions {
  int views = 40;
  int width = 960, height = 720;  // pixels
  void Check() const;
};

// Candidates stand on rings of several heights and distances around the scene's center, looking at
// it, and inside the scene, looking out. Each is rendered small, and its blended pixels are counted
// by Gaussian. They do not count if something stands right before the camera, or if the Gaussians
// were trained from another side (TrainedShare). This tells rooms from objects, and a scene's front
// from its back. Then views are chosen one by one. The next is the one that adds most to sum_g w_g
// log(1 + n_g). n_g says how often Gaussian g is seen, and w_g fades with the distance from the
// center, so that floaters and sky have little weight.
//
// The model comes with sparse points at opaque, small Gaussians and their tracks. The same splat
// and options give the same views. InputError when no Gaussian is visible; OptionError for options
// out of range. Stage: "views".
Workspace PlaceViews(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
                     const VirtualViewOptions& options, Monitor& monitor);

// The same, or an earlier result for the same Gaussians and options, from the folder `cache`.
// Beyond 64 MiB the results unused for longest are deleted. Nothing is stored if `cache` is empty
// or cannot be written.
Workspace PlaceViewsOnce(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
                         const VirtualViewOptions& options, const std::filesystem::path& cache,
                         Monitor& monitor);

// The folder for results that take long to compute: $RETINT_CACHE, else retint in $XDG_CACHE_HOME
// or ~/.cache. Empty if RETINT_CACHE is empty, or if there is no home folder.
std::filesystem::path CacheFolder();

// Views that were placed before: the COLMAP model in `folder`. InputError as Workspace::Open().
Workspace ReadPlacedViews(const std::filesystem::path& folder);

}  // namespace retint
