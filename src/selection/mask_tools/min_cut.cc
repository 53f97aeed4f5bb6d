// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/min_cut.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include <opencv2/core.hpp>
// The graph of OpenCV's GrabCut; it needs the two headers above.
#include <opencv2/imgproc/detail/gcgraph.hpp>

namespace retint {

std::vector<uint8_t> MinCut(const EdgeMatrix& edges, std::span<const float> odds) {
  const size_t count = odds.size();
  if (count == 0) return {};  // OpenCV refuses an empty graph
  cv::detail::GCGraph<float> graph(unsigned(count), unsigned(edges.other.size()));
  for (size_t i = 0; i < count; ++i) {
    graph.addTermWeights(graph.addVtx(), std::max(0.0f, odds[i]), std::max(0.0f, -odds[i]));
  }
  for (size_t i = 0; i < count; ++i) {
    for (size_t e = edges.begin[i]; e < edges.begin[i + 1]; ++e) {
      if (size_t(edges.other[e]) <= i) continue;  // visit every edge once
      graph.addEdges(int(i), edges.other[e], edges.weight[e], edges.weight[e]);
    }
  }
  graph.maxFlow();
  std::vector<uint8_t> sides(count);
  for (size_t i = 0; i < count; ++i) sides[i] = graph.inSourceSegment(int(i)) ? 1 : 0;
  return sides;
}

}  // namespace retint
