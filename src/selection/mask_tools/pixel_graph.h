// SPDX-License-Identifier: BSD-3-Clause
// The pixels of a picture as a graph, in which strokes are given and borders are looked for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/image.h"
#include "selection/graph_solver.h"

namespace retint {

// The given side of a pixel, or nothing.
enum class Seed : uint8_t { kNone, kInside, kOutside };

// The pixels that are not given, in their order.
struct FreePixels {
  std::vector<int> pixels;
  EdgeMatrix edges;          // between them: indices into `pixels`
  std::vector<float> steps;  // of each edge: the change of the features along it, and its length
  std::vector<float> given;  // log odds of "inside" by the given pixels beside each
  // The least step to a given pixel of each kind beside each, infinity where there is none.
  std::vector<float> to_inside, to_outside;

  // Least sum of steps through free pixels from each to any seed of that kind (Dijkstra 1959);
  // infinity where there is no way.
  std::vector<float> DistancesTo(Seed kind) const;
};

// Each pixel with its four neighbors and the four across.
class PixelGraph {
 public:
  // `features`: OKLab and depth (view_layers.h); `valleys` of the same size (surface_edges.h),
  // which stay alive. A border between two pixels costs most where they are alike and no valley
  // lies between them. The picture's own contrast says what is alike (Boykov and Jolly 2001). A
  // step over a valley is as long as a change of the features by `valley_cost`.
  PixelGraph(const PixelArray<float, 4>& features, const ScalarImage& valleys, double valley_cost);

  FreePixels Free(const std::vector<Seed>& seeds) const;

 private:
  static constexpr int kWindow = 9;  // a pixel and its neighbors, row by row

  // visit(neighbor, squared change of the features, length in pixels), neighbors ascending.
  template <typename Visit>
  void ForNeighbors(size_t pixel, const Visit& visit) const;
  float Weight(size_t from, size_t to, float squared, double length) const;
  float Step(size_t from, size_t to, float squared, double length) const;
  double Valley(size_t from, size_t to) const;

  const ScalarImage& valleys_;
  double valley_cost_;
  PixelArray<float, kWindow> squared_;  // changes of the features
  double contrast_ = 0;                 // of squared changes, in 1 / features^2
};

}  // namespace retint
