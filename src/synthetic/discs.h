// SPDX-License-Identifier: BSD-3-Clause
// The flat Gaussians of a synthetic world before they have a color. Internal to the synthetic
// scenes.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "synthetic/views.h"

namespace retint::synthetic {

// A place where a disc may go.
struct Seed {
  Vec3 point;
  double radius;  // meters to its neighbors
  double pixels;  // the same in the view
  uint32_t pixel;
  uint16_t view;
  int16_t level;
  uint64_t order;
};

struct Disc {
  Vec3 point;         // center
  Vec3 surface;       // what it shows: on the surface, where `point` may lie below
  Vec3 normal, axis;  // axis: tangent of the first scale
  double sigma[2];
  int part;
  Hit hit;              // at `surface`
  double rod = 0;       // radius where it is a bead on a rod's axis, as thick as it is wide
  double pixel = 0;     // meters a pixel in the view that it comes from
  double wanted = 0;    // standard deviation where nothing asks for less
  bool solid = false;   // `point` is sunk below the surface
  bool filler = false;  // closes a crack from below

  Vec3 Across() const { return normal.cross(axis); }
  double Thickness() const {  // standard deviation along the normal
    return rod > 0 ? sigma[1] : std::max(2e-4, 0.12 * std::min(sigma[0], sigma[1]));
  }
};

// A round disc, or near the part's edge one that ends there, or a bead on a rod's axis. None where
// the seed's pixel misses the part.
std::optional<Disc> MakeDisc(const World& world, const std::vector<TracedView>& views,
                             const Seed& seed, int part);

// A disc trimmed or moved away from an edge leaves a crack along it that shows the inside. This
// makes a disc deeper in the solid that closes the crack, if one is needed.
std::optional<Disc> MakeFiller(const World& world, const Disc& disc);

// The objects' outlines in every view.
class Silhouettes {
 public:
  Silhouettes(const World& world, const std::vector<TracedView>& views);
  // Renders blur a disc by a pixel, so that a disc at an outline reaches beyond it. Moves and
  // shrinks the disc along its own axes until its opaque part lies inside its object's outline in
  // every view, except behind something nearer.
  void KeepInside(Disc* disc) const;
  // Whether in every view something lies in front of the disc's middle and of its ends.
  bool Hides(const Disc& disc) const;

 private:
  struct Sight;
  struct Demand;
  std::vector<Sight> Sights(const Disc& disc, const Vec3 (&axes)[3]) const;
  // Meters from a point along an axis, forwards and backwards, to the end of its object before
  // something behind it. Negative on the side from which a point outside has to return.
  std::array<double, 2> Walk(const Sight& sight, const Vec2& at, int axis, double z, int object,
                             double reach) const;
  Demand Ask(const std::vector<Sight>& sights, const Disc& disc, int axis, int object) const;

  const World& world_;
  const std::vector<TracedView>& views_;
  // Per view: pixels (chessboard) to the nearest pixel of which a neighbor shows another object.
  std::vector<PixelArray<uint8_t, 1>> distances_;
};

}  // namespace retint::synthetic
