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
// it, and inside the scene, looking out. Each is rendered small; it counts for what it sees well
// (blended pixels by Gaussian), as long as nothing stands right before it and its Gaussians were
// trained from its side (TrainedShare; this tells rooms from objects and the front of a scene from
// its back). Views are then chosen one by one, the next being the one that adds most to
// sum_g w_g log(1 + n_g), where n_g says how often Gaussian g is seen and w_g fades with the
// distance from the center, which leaves floaters and sky aside.
//
// The model comes with sparse points at opaque, small Gaussians and their tracks. The same splat
// and options give the same views. InputError when no Gaussian is visible; OptionError for options
// out of range. Stage: "views".
Workspace PlaceViews(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
                     const VirtualViewOptions& options, Monitor& monitor);

// The same, or what it gave before for the same Gaussians and options: kept in the folder `cache`,
// of which what was not used for longest goes beyond 64 MiB. Nothing is kept where `cache` is empty
// or cannot be written.
Workspace PlaceViewsOnce(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
                         const VirtualViewOptions& options, const std::filesystem::path& cache,
                         Monitor& monitor);

// The folder in which the programs keep results that take long to compute: $RETINT_CACHE, else
// retint in $XDG_CACHE_HOME or ~/.cache. Empty where RETINT_CACHE is, or where there is no home.
std::filesystem::path CacheFolder();

// Views that were placed before: the COLMAP model in `folder`. InputError as Workspace::Open().
Workspace ReadPlacedViews(const std::filesystem::path& folder);

}  // namespace retint
