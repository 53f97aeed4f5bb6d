// SPDX-License-Identifier: BSD-3-Clause
// A cloud of Gaussians seen from an arc of small cameras; one half of it is the selection.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "recolor/sh_refitter.h"
#include "render/renderer.h"
#include "tests/support/blend.h"

namespace retint {

// RefitTarget::photo of a photo in memory, which must outlive the target.
inline std::function<std::shared_ptr<const Image>()> HeldPhoto(const Image& photo) {
  return [&photo] { return std::shared_ptr<const Image>(std::shared_ptr<const Image>(), &photo); };
}

// Fixed arithmetic on top of the engine: std distributions differ between standard libraries.
class TestRandom {
 public:
  explicit TestRandom(uint64_t seed) : engine_(seed) {}
  double Uniform(double low, double high) {
    return low + (high - low) * (double(engine_() >> 11) * 0x1.0p-53);
  }

 private:
  std::mt19937_64 engine_;
};

inline PosedCamera LookAtOrigin(double azimuth, double distance, int width = 64, int height = 48) {
  PosedCamera view;
  view.camera = Camera::Pinhole(1, width, height, 70, 70, width / 2.0, height / 2.0);
  view.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(azimuth, Eigen::Vector3d::UnitY()));
  view.cam_from_world.translation = {0, 0, distance};
  return view;
}

inline void SetGaussian(GaussianModel& model, size_t g, const Eigen::Vector3d& mean, double scale,
                        double opacity_logit) {
  for (size_t c = 0; c < 3; ++c) {
    model.means[3 * g + c] = float(mean[Eigen::Index(c)]);
    model.log_scales[3 * g + c] = float(std::log(scale));
  }
  model.quats_wxyz[4 * g] = 1;
  for (size_t c = 1; c < 4; ++c) model.quats_wxyz[4 * g + c] = 0;
  model.opacity_logits[g] = float(opacity_logit);
}

struct TinyScene {
  GaussianModel model;
  std::vector<PosedCamera> cameras;
  std::vector<Mask> masks;    // of the selection, soft
  std::vector<Image> photos;  // filled by tests that need them
  std::vector<float> shares;  // 1 for the selected Gaussians, 0 for the others
  std::shared_ptr<Backend> backend = CreateBackend("cpu");

  explicit TinyScene(uint64_t seed, int count = 120, int views = 6, int degree = 2) {
    TestRandom random(seed);
    model.Resize(size_t(count), degree);
    for (size_t g = 0; g < size_t(count); ++g) {
      const Eigen::Vector3d mean(random.Uniform(-1, 1), random.Uniform(-0.7, 0.7),
                                 random.Uniform(-0.6, 0.6));
      SetGaussian(model, g, mean, random.Uniform(0.04, 0.16), random.Uniform(-1, 4));
      for (size_t k = 0; k < size_t(model.NumShCoeffs()); ++k) {
        const double range = k == 0 ? 1.0 : 0.12;
        for (size_t c = 0; c < 3; ++c) {
          model.sh[(g * size_t(model.NumShCoeffs()) + k) * 3 + c] =
              float(random.Uniform(-range, range));
        }
      }
      shares.push_back(mean.x() < 0 ? 1.0f : 0.0f);
    }
    Renderer renderer = MakeRenderer();
    for (int v = 0; v < views; ++v) {
      cameras.push_back(LookAtOrigin(0.5 * (v - views / 2.0) / views, 4.0));
      const auto soft = BlendFeatures(renderer, cameras.back(), shares);
      Mask mask(64, 48);
      for (size_t p = 0; p < soft.size(); ++p) {
        mask.data[p] = uint8_t(std::lround(255 * std::clamp(soft[p], 0.0f, 1.0f)));
      }
      masks.push_back(mask);
    }
  }

  Renderer MakeRenderer(const RendererOptions& options = {}) const {
    return Renderer(backend, model, options);
  }

  std::vector<RefitTarget> Targets() const {
    std::vector<RefitTarget> targets;
    for (size_t v = 0; v < cameras.size(); ++v) {
      targets.push_back({"view" + std::to_string(v), cameras[v], &masks[v]});
      if (!photos.empty()) targets.back().photo = HeldPhoto(photos[v]);
    }
    return targets;
  }

  void FillMasks(uint8_t value) {
    for (auto& mask : masks) std::fill(mask.data.begin(), mask.data.end(), value);
  }
};

}  // namespace retint
