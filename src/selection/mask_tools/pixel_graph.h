// SPDX-License-Identifier: BSD-3-Clause
// The pixels of a picture as a graph. Strokes give some pixels a side, and a cut finds the border.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/image.h"
#include "selection/graph_solver.h"

namespace retint {

// The side that a stroke gives a pixel, if any.
enum class Seed : uint8_t { kNone, kInside, kOutside };

// Pixels without a stroke, in order.
struct FreePixels {
  std::vector<int> pixels;
  EdgeMatrix edges;          // between them: indices into `pixels`
  std::vector<float> steps;  // of each edge: its length, from the change of the features along it
  std::vector<float> given;  // for each: log odds of "inside" from neighbors with strokes
  // For each: the shortest step to a neighbor with a stroke of this side; infinity if it has none.
  std::vector<float> to_inside, to_outside;

  // For each pixel: the shortest way through free pixels to a stroke of that side (Dijkstra 1959);
  // infinity if no way leads there.
  std::vector<float> DistancesTo(Seed kind) const;
};

// Each pixel is joined with its eight neighbors.
class PixelGraph {
 public:
  // `features`: OKLab and depth (view_layers.h). `valleys`: creases, of the same size
  // (surface_edges.h). Both must outlive this. A border costs most between similar pixels without a
  // crease between them; the picture's contrast decides what is similar (Boykov and Jolly 2001). A
  // step over a crease is as long as a change of the features by `valley_cost`.
  PixelGraph(const PixelArray<float, 4>& features, const ScalarImage& valleys, double valley_cost);

  FreePixels Free(const std::vector<Seed>& seeds) const;

 private:
  static constexpr int kWindow = 9;  // a pixel and its neighbors, row by row

  // Calls visit(neighbor, squared change of the features, length in pixels) in ascending order.
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
