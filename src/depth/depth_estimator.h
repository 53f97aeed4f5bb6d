// SPDX-License-Identifier: BSD-3-Clause
// Depth of one frozen view, by one of several methods behind one interface.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "scene/camera.h"
#include "scene/grid_rect.h"
#include "scene/image.h"

namespace retint {

struct DepthEstimate {
  DepthMap depth;  // z along the viewing axis, world units; 0 where unknown
  Mask valid;      // 255 measured by the method itself, 0 filled from the rough depth or unknown
  double valid_fraction = 0;  // of all pixels that were asked for
  std::string method;         // the name in DepthMethods()
  std::string reason;         // one line: the work done, or why pixels are not valid
  std::string warning;        // one line: the requested part that was not done; empty: none
};

class DepthEstimator {
 public:
  virtual ~DepthEstimator() = default;
  virtual DepthEstimate Estimate(const PosedCamera& view, Monitor& monitor) = 0;
  // The same, where only the pixels of `part`, which lies in the view, are asked for: others may be
  // left to the rough depth.
  virtual DepthEstimate EstimatePart(const PosedCamera& view, const GridRect& /*part*/,
                                     Monitor& monitor) {
    return Estimate(view, monitor);
  }
  // Every camera through which Estimate() will look at the scene, given a renderer that shows
  // `view` as it is.
  virtual std::vector<PosedCamera> Cameras(const PosedCamera& view, Monitor&) { return {view}; }
};

}  // namespace retint
