// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/gaussian_paint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "kernels/common/color_spaces.h"
#include "kernels/common/projection.h"
#include "recolor/direction_fit.h"
#include "render/color_encoding.h"

namespace retint {
namespace {

constexpr int kChannels = 5;         // color times alpha, alpha, 1
constexpr double kLeastSeen = 0.02;  // of a Gaussian, for it to be painted in a view
constexpr float kLeastAlpha = 1.0f / 255;
// Of luminances that are compared: those of single dark Gaussians say little about the light.
constexpr float kLeastLight = 0.05f;

// A layer's paint on one Gaussian.
struct Share {
  PaintedGaussian painted;
  double weight;  // of the painted pixels
};

// The layer as an image of its view: color times alpha, alpha, 1.
std::vector<float> ImageOf(const PaintLayer& layer, const Camera& camera) {
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  std::vector<float> image(pixels * kChannels, 0.0f);
  for (size_t p = 0; p < pixels; ++p) image[p * kChannels + 4] = 1;
  for (int y = 0; y < layer.alpha.height; ++y) {
    for (int x = 0; x < layer.alpha.width; ++x) {
      const int to_x = layer.x + x, to_y = layer.y + y;
      if (to_x < 0 || to_y < 0 || to_x >= camera.width || to_y >= camera.height) continue;
      const size_t p = size_t(to_y) * size_t(camera.width) + size_t(to_x);
      float* pixel = &image[p * kChannels];
      const float alpha = float(layer.alpha(x, y)) / 255;
      for (int c = 0; c < 3; ++c) pixel[c] = alpha * float(layer.color(x, y, c)) / 255;
      pixel[3] = alpha;
    }
  }
  return image;
}

// The sum of a Gaussian's alpha over all pixels of a view, were nothing before it.
double WholeWeight(const GaussianModel& model, size_t g, const CameraParams& camera) {
  const float* mean = &model.means[3 * g];
  Splat splat{};
  const Covariance3 covariance = CovarianceOf(&model.quats_wxyz[4 * g], &model.log_scales[3 * g]);
  if (!ProjectGaussian(camera, {mean[0], mean[1], mean[2]}, covariance,
                       Sigmoid(model.opacity_logits[g]),
                       model.traits.render_model == RenderModel::kMip, &splat)) {
    return 0;
  }
  // The conic carries log2(e): the integral of 2^(a x^2 + b x y + c y^2).
  const double det = 4 * double(splat.a) * double(splat.c) - double(splat.b) * double(splat.b);
  return det > 0 ? std::exp2(double(splat.log2_opacity)) * 2 * std::numbers::pi /
                       (std::numbers::ln2 * std::sqrt(det))
                 : 0;
}

// Appends a layer's paint on the Gaussians that its view sees.
void AddLayer(Renderer& renderer, const GaussianModel& model, const PaintLayer& layer,
              const PosedCamera& camera, std::vector<Share>* shares) {
  Backend& backend = renderer.backend();
  const auto geometry = renderer.Geometry(camera);
  const size_t rows = size_t(geometry->num_rows());
  if (rows == 0) return;
  const auto image = backend.Upload(std::span<const float>(ImageOf(layer, camera.camera)));
  const auto by_row = backend.Allocate<float>(rows * kChannels);
  backend.blend().BlendTranspose(
      *geometry, {.residual = image.data(), .channels = kChannels, .result = by_row.data()});
  const std::vector<float> sums = backend.Download(by_row.data(), rows * kChannels);
  const std::vector<int32_t> indices = backend.Download(geometry->rows(), rows);
  const Eigen::Vector3d eye = camera.Center();
  for (size_t r = 0; r < rows; ++r) {
    const float* sum = &sums[r * kChannels];
    if (!(sum[3] > kLeastAlpha * sum[4])) continue;
    const size_t g = size_t(indices[r]);
    if (double(sum[4]) < kLeastSeen * WholeWeight(model, g, geometry->camera())) continue;
    const Eigen::Vector3d sight = Eigen::Vector3f(&model.means[3 * g]).cast<double>() - eye;
    shares->push_back({{indices[r], Eigen::Vector3f(sum) / sum[3], std::min(sum[3] / sum[4], 1.0f),
                        sight.normalized().cast<float>()},
                       double(sum[3])});
  }
}

// Those of one Gaussian.
PaintedGaussian Merged(std::span<const Share> shares) {
  PaintedGaussian merged = shares.front().painted;
  double most = 0, weight = 0;
  Eigen::Vector3d color = Eigen::Vector3d::Zero();
  for (const Share& share : shares) {
    color += share.weight * share.painted.color.cast<double>();
    weight += share.weight;
    merged.alpha = std::max(merged.alpha, share.painted.alpha);
    if (share.weight <= most) continue;
    most = share.weight;
    merged.seen = share.painted.seen;
  }
  merged.color = (color / weight).cast<float>();
  return merged;
}

}  // namespace

bool GaussianPaint::IsOf(const PictureEdit& picture) const {
  return of.get() == &picture || (of && of->layers == picture.layers);
}

GaussianPaint FindGaussianPaint(Renderer& renderer, const GaussianModel& model,
                                std::shared_ptr<const PictureEdit> picture,
                                const std::vector<PosedCamera>& cameras) {
  CheckOption(cameras.size() == picture->layers.size(), "paint: one camera a layer is needed");
  std::vector<Share> shares;
  for (size_t k = 0; k < cameras.size(); ++k) {
    AddLayer(renderer, model, picture->layers[k], cameras[k], &shares);
  }
  // Of one Gaussian in the order of the layers, whatever that of the rows is.
  std::stable_sort(shares.begin(), shares.end(), [](const Share& x, const Share& y) {
    return x.painted.index < y.painted.index;
  });
  GaussianPaint paint{std::move(picture), {}};
  for (size_t begin = 0, end = 0; begin < shares.size(); begin = end) {
    while (end < shares.size() && shares[end].painted.index == shares[begin].painted.index) ++end;
    paint.gaussians.push_back(Merged(std::span(shares).subspan(begin, end - begin)));
  }
  return paint;
}

namespace {

// The change of one Gaussian's coefficients by paint.
class OneChange {
 public:
  OneChange(const ColorEdit& edit, int num_coeffs)
      : edit_(edit),
        colors_(edit.light_map),
        fit_(num_coeffs),
        num_coeffs_(num_coeffs),
        degree_(int(std::lround(std::sqrt(double(num_coeffs)))) - 1) {}

  const PaintedEdit& edit() const { return edit_; }

  DirectionFit::Colors Find(const float* sh, float share, const PaintedGaussian& painted) const {
    const float there = LightSeen(sh, painted.seen);
    const Eigen::Vector3f paint =
        painted.color.unaryExpr([](float v) { return LinearFromSrgb(v); });
    return fit_.Fit(sh, [&](const Eigen::Vector3f& color, const Eigen::Vector3f& of_model) {
      const Eigen::Vector3f shown = Encoded(of_model);
      const float light = std::clamp((LightOf(shown.data()) + kLeastLight) / (there + kLeastLight),
                                     1 / kMostPaintLight, kMostPaintLight);
      const Eigen::Vector3f lit =
          paint.unaryExpr([&](float v) { return SrgbFromLinear(light * v); });
      const float whole = share * edit_.strength();
      const auto change = [&](float alpha) {
        const Eigen::Vector3f wanted = whole * (edit_.Apply(shown, lit, alpha) - shown);
        if (!colors_.maps()) return wanted;
        Eigen::Vector3f goal = shown + wanted;
        colors_.FromSrgb(goal.data());
        return Eigen::Vector3f(goal - of_model);
      };
      const Eigen::Vector3f with = change(painted.alpha), without = change(0);
      return Eigen::Vector3f(DirectionFit::Rise(with, whole, color) -
                             DirectionFit::Rise(without, whole, color));
    });
  }

 private:
  // A color of the model, as sRGB.
  Eigen::Vector3f Encoded(Eigen::Vector3f color) const {
    colors_.ToSrgb(color.data());
    return color;
  }

  // The luminance of coefficients [K, 3] in a direction.
  float LightSeen(const float* sh, const Eigen::Vector3f& direction) const {
    float basis[kMaxShCoeffs];
    ShBasis(degree_, direction.x(), direction.y(), direction.z(), basis);
    Eigen::Vector3f color = Eigen::Vector3f::Constant(0.5f);
    for (int k = 0; k < num_coeffs_; ++k) color += basis[k] * Eigen::Vector3f(sh + 3 * k);
    color = Encoded(color.cwiseMax(0.0f));
    return LightOf(color.data());
  }

  PaintedEdit edit_;
  SingleColors colors_;  // of the model
  DirectionFit fit_;
  int num_coeffs_, degree_;
};

}  // namespace

PaintChange::PaintChange(std::span<const float> sh, int num_coeffs, std::span<const float> shares,
                         const ColorEdit& edit, const GaussianPaint* paint, double active_threshold,
                         std::span<const int32_t> gaussians)
    : block_(size_t(num_coeffs) * 3) {
  if (!paint || !edit.HasPaint()) return;
  const OneChange change(edit, num_coeffs);
  if (!paint->IsOf(*change.edit().picture())) return;
  std::vector<const PaintedGaussian*> painted;
  for (const PaintedGaussian& one : paint->gaussians) {
    size_t at = size_t(one.index);
    if (!gaussians.empty()) {
      const auto found = std::lower_bound(gaussians.begin(), gaussians.end(), one.index);
      if (found == gaussians.end() || *found != one.index) continue;
      at = size_t(found - gaussians.begin());
    }
    if (!(shares[at] > active_threshold)) continue;
    at_.push_back(at);
    painted.push_back(&one);
  }
  changes_.resize(at_.size() * block_);
  ParallelRanges(int64_t(at_.size()), 64, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      const DirectionFit::Colors one =
          change.Find(&sh[at_[i] * block_], shares[at_[i]], *painted[i]);
      std::copy_n(one.data(), block_, &changes_[i * block_]);
    }
  });
}

void PaintChange::AddTo(std::span<float> sh) const {
  for (size_t i = 0; i < at_.size(); ++i) {
    for (size_t k = 0; k < block_; ++k) {
      const float change = changes_[i * block_ + k];
      if (change != 0) sh[at_[i] * block_ + k] += change;  // -0 stays
    }
  }
}

}  // namespace retint
