// SPDX-License-Identifier: BSD-3-Clause
#include "opening/point_registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "base/median.h"
#include "base/parallel.h"
#include "render/color_encoding.h"
#include "scene/transform.h"

namespace retint {
namespace {

using Eigen::Vector3d;

constexpr size_t kFewest = 20;
constexpr size_t kMostPoints = 700;   // of a thinned cloud: closest points are looked for in all
constexpr double kColorScale = 0.25;  // at which colors that differ count 1/e

// A cloud thinned to one point a cell, about its middle and in its own unit.
struct Thinned {
  Vector3d middle;
  double unit = 1;
  std::vector<Vector3d> points, colors;
};

Vector3d MiddleOf(const std::vector<Vector3d>& points) {
  Vector3d middle;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const Vector3d& point : points) values.push_back(point[k]);
    middle[k] = Median(std::move(values));
  }
  return middle;
}

// The mean point and color of each cell of `size` that holds any, in the order of the cells.
void Thin(const ColoredCloud& cloud, const Thinned& frame, double reach, double size,
          std::vector<Vector3d>& points, std::vector<Vector3d>& colors) {
  struct Cell {
    Vector3d point = Vector3d::Zero(), color = Vector3d::Zero();
    double count = 0;
  };
  std::map<std::array<int, 3>, Cell> cells;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const Vector3d x = (cloud.points[i] - frame.middle) / frame.unit;
    if (!(x.norm() <= reach)) continue;
    Cell& cell = cells[{int(std::floor(x.x() / size)), int(std::floor(x.y() / size)),
                        int(std::floor(x.z() / size))}];
    cell.point += x;
    cell.color += cloud.colors[i];
    cell.count += 1;
  }
  points.clear(), colors.clear();
  for (const auto& [index, cell] : cells) {
    points.push_back(cell.point / cell.count);
    colors.push_back(cell.color / cell.count);
  }
}

Thinned Thin(const ColoredCloud& cloud) {
  constexpr double kReach = 2.5;
  Thinned thin;
  thin.middle = MiddleOf(cloud.points);
  std::vector<double> distances;
  for (const Vector3d& point : cloud.points) distances.push_back((point - thin.middle).norm());
  thin.unit = std::max(Median(std::move(distances)), 1e-12);
  // Of even cells the middle and the size do not depend on where points are dense.
  Thin(cloud, thin, 2 * kReach, 0.15, thin.points, thin.colors);
  const Vector3d middle = MiddleOf(thin.points);
  distances.clear();
  for (const Vector3d& point : thin.points) distances.push_back((point - middle).norm());
  thin.middle += thin.unit * middle;
  thin.unit *= std::max(Median(std::move(distances)), 1e-6);
  double size = 0.1;
  do {
    Thin(cloud, thin, kReach, size, thin.points, thin.colors);
    size *= 1.15;
  } while (thin.points.size() > kMostPoints);
  return thin;
}

// Columns: the principal axes, right-handed, the longest first.
Eigen::Matrix3d AxesOf(const std::vector<Vector3d>& points) {
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Vector3d& x : points) covariance += x * x.transpose() / (1 + x.squaredNorm());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  Eigen::Matrix3d axes = solver.eigenvectors().rowwise().reverse();
  if (axes.determinant() < 0) axes.col(2) *= -1;
  return axes;
}

// The 24 rotations that bring axes onto axes.
std::vector<Eigen::Matrix3d> AxisTurns() {
  std::vector<Eigen::Matrix3d> turns;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
      for (int k = 0; k < 3; ++k) turn(k, order[size_t(k)]) = signs >> k & 1 ? -1 : 1;
      if (turn.determinant() > 0) turns.push_back(turn);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return turns;
}

struct Match {
  size_t from, to;
  double distance, weight;  // weight: by color
};

void AddClosest(const std::vector<Vector3d>& of, const std::vector<Vector3d>& of_colors,
                const std::vector<Vector3d>& in, const std::vector<Vector3d>& in_colors,
                bool of_is_from, std::vector<Match>& matches) {
  for (size_t i = 0; i < of.size(); ++i) {
    double best = std::numeric_limits<double>::infinity();
    size_t at = 0;
    for (size_t k = 0; k < in.size(); ++k) {
      const double squared = (of[i] - in[k]).squaredNorm();
      if (squared < best) best = squared, at = k;
    }
    const double color = (of_colors[i] - in_colors[at]).squaredNorm();
    const double weight = std::exp(-color / (kColorScale * kColorScale));
    matches.push_back({of_is_from ? i : at, of_is_from ? at : i, std::sqrt(best), weight});
  }
}

// Weighted similarity of matched points (Umeyama 1991).
Sim3d Fit(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to,
          const std::vector<Match>& matches, const std::vector<double>& weights, const Sim3d& old) {
  Vector3d mean_from = Vector3d::Zero(), mean_to = Vector3d::Zero();
  double total = 0;
  for (size_t m = 0; m < matches.size(); ++m) {
    mean_from += weights[m] * from[matches[m].from];
    mean_to += weights[m] * to[matches[m].to];
    total += weights[m];
  }
  if (!(total > 1e-9)) return old;
  mean_from /= total, mean_to /= total;
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  double spread_from = 0, spread_to = 0;
  for (size_t m = 0; m < matches.size(); ++m) {
    const Vector3d a = from[matches[m].from] - mean_from, b = to[matches[m].to] - mean_to;
    cross += weights[m] * b * a.transpose();
    spread_from += weights[m] * a.squaredNorm();
    spread_to += weights[m] * b.squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign(2, 2) = -1;
  Sim3d fit;
  fit.rotation = Eigen::Quaterniond(svd.matrixU() * sign * svd.matrixV().transpose());
  // Symmetric in the clouds, as the matches are.
  fit.scale = std::sqrt(std::max(spread_to, 1e-12) / std::max(spread_from, 1e-12));
  fit.translation = mean_to - fit.scale * (fit.rotation * mean_from);
  return fit;
}

// In the units of the thinned clouds.
RegisteredCloud Refine(const Thinned& from, const Thinned& to, Sim3d guess) {
  constexpr int kRounds = 24;
  constexpr double kWide = 0.6, kNarrow = 0.1;
  RegisteredCloud result;
  std::vector<Match> matches;
  std::vector<Vector3d> moved(from.points.size());
  for (int round = 0; round <= kRounds; ++round) {
    const double reach = kWide * std::pow(kNarrow / kWide, double(round) / kRounds);
    for (size_t i = 0; i < moved.size(); ++i) moved[i] = guess * from.points[i];
    matches.clear();
    AddClosest(moved, from.colors, to.points, to.colors, true, matches);
    AddClosest(to.points, to.colors, moved, from.colors, false, matches);
    std::vector<double> weights;
    double near_from = 0, near_to = 0;
    for (size_t m = 0; m < matches.size(); ++m) {
      const double ratio = matches[m].distance / reach;
      weights.push_back(matches[m].weight / std::pow(1 + ratio * ratio, 2));
      (m < moved.size() ? near_from : near_to) += weights.back();
    }
    result.score = 0.5 * (near_from / double(moved.size()) + near_to / double(to.points.size()));
    if (round == kRounds) break;
    guess = Fit(from.points, to.points, matches, weights, guess);
    // Neither may shrink into a corner of the other.
    guess.scale = std::clamp(guess.scale, 0.2, 5.0);
  }
  result.to_from_from = guess;
  return result;
}

bool Alike(const Sim3d& a, const Sim3d& b) {
  constexpr double kAngle = 0.1, kShift = 0.15;  // radians, units of the clouds
  return a.rotation.angularDistance(b.rotation) < kAngle &&
         std::abs(std::log(a.scale / b.scale)) < kShift &&
         (a.translation - b.translation).norm() < kShift;
}

}  // namespace

ColoredCloud CloudOf(const Reconstruction& model) {
  ColoredCloud cloud;
  for (const auto& [id, point] : model.points) {
    cloud.points.push_back(point.xyz);
    cloud.colors.push_back(point.color.cast<double>() / 255);
  }
  return cloud;
}

ColoredCloud CloudOf(const GaussianModel& model) {
  ColoredCloud cloud;
  const BaseColors colors(model);
  for (size_t i = 0; i < model.NumGaussians(); ++i) {
    constexpr float kLeast = -0.85F;  // opacity 0.3
    if (model.opacity_logits[i] < kLeast) continue;
    cloud.points.push_back(
        Eigen::Map<const Eigen::Vector3f>(model.means.data() + 3 * i).cast<double>());
    cloud.colors.push_back(colors.Of(i).cast<double>());
  }
  return cloud;
}

std::vector<RegisteredCloud> RegisterClouds(const ColoredCloud& from, const ColoredCloud& to,
                                            size_t most, Monitor& monitor) {
  if (from.points.size() < kFewest || to.points.size() < kFewest) return {};
  monitor.Step("points", 0, 1);
  const Thinned a = Thin(from), b = Thin(to);
  if (a.points.size() < kFewest || b.points.size() < kFewest) return {};
  const Eigen::Matrix3d axes_a = AxesOf(a.points), axes_b = AxesOf(b.points);
  std::vector<Sim3d> guesses;
  for (const Eigen::Matrix3d& turn : AxisTurns()) {
    for (const double scale : {1.0, 0.75, 1.33}) {
      const Eigen::Matrix3d rotation = axes_b * turn * axes_a.transpose();
      guesses.push_back({scale, Eigen::Quaterniond(rotation), Vector3d::Zero()});
    }
  }
  std::vector<RegisteredCloud> refined(guesses.size());
  constexpr size_t kAtOnce = 8;
  for (size_t first = 0; first < guesses.size(); first += kAtOnce) {
    monitor.Step("points", double(first), double(guesses.size()));
    ParallelTasks(int64_t(std::min(kAtOnce, guesses.size() - first)), [&](int64_t i) {
      refined[first + size_t(i)] = Refine(a, b, guesses[first + size_t(i)]);
    });
  }
  std::stable_sort(refined.begin(), refined.end(),
                   [](const auto& x, const auto& y) { return x.score > y.score; });
  std::vector<RegisteredCloud> best;
  for (const RegisteredCloud& one : refined) {
    const bool known = std::any_of(best.begin(), best.end(), [&](const RegisteredCloud& other) {
      return Alike(one.to_from_from, other.to_from_from);
    });
    if (!known && best.size() < most) best.push_back(one);
  }
  const Sim3d unit_a{1 / a.unit, Eigen::Quaterniond::Identity(), -a.middle / a.unit};
  const Sim3d from_unit_b{b.unit, Eigen::Quaterniond::Identity(), b.middle};
  for (RegisteredCloud& one : best) {
    one.to_from_from = Compose(from_unit_b, Compose(one.to_from_from, unit_a));
  }
  monitor.Step("points", 1, 1);
  return best;
}

}  // namespace retint
