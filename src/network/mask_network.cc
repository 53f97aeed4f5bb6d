// SPDX-License-Identifier: BSD-3-Clause
#include "network/mask_network.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "network/network_name.h"
#include "network/onnx_model.h"
#include "network/pixel_values.h"
#include "network/program.h"

namespace retint {
namespace {

constexpr int kUsualSide = 1024;  // of a network for any size: ISNet's and BiRefNet's

class OnnxOutlines : public MaskNetwork {
 public:
  explicit OnnxOutlines(NetworkName name)
      : name_(std::move(name)), values_(ValuesOf(name_, PixelValues::kHalf)) {
    name_.OneOf("provider", "cpu", {"cpu"});
  }

  ScalarImage Outline(const Image8& image, const Image8&, const Monitor& monitor) const override {
    const std::lock_guard lock(mutex_);
    Open();
    std::vector<Tensor> inputs = {InputOf(image)};
    const std::vector<Tensor> outputs = model_->Run(std::move(inputs), monitor);
    cv::Mat found = MaskIn(outputs);
    double least = 0, most = 0;
    cv::minMaxLoc(found, &least, &most);
    constexpr double kSlack = 0.01;              // of half floats
    if (least < -kSlack || most > 1 + kSlack) {  // log odds
      cv::exp(-found, found);
      found = 1 / (1 + found);
    }
    ScalarImage mask(image.width, image.height);
    cv::Mat out(image.height, image.width, CV_32F, mask.data.data());
    cv::resize(found, out, out.size(), 0, 0, cv::INTER_LINEAR);
    for (float& v : mask.data) v = std::clamp(v, 0.0f, 1.0f);
    return mask;
  }

  std::string Identity() const override {
    const std::lock_guard lock(mutex_);
    Open();
    return model_->Identity();
  }

 private:
  void Open() const {
    if (model_) return;
    auto model = std::make_unique<OnnxModel>(name_.file, name_.settings.contains("provider"));
    const auto& inputs = model->inputs();
    const std::vector<int64_t> shape = inputs.empty() ? std::vector<int64_t>() : inputs[0].shape;
    constexpr int64_t kMostSide = 1 << 14;
    const auto is_side = [](int64_t side) { return side != 0 && side <= kMostSide; };
    const bool fits = inputs.size() == 1 && inputs[0].is_tensor && shape.size() == 4 &&
                      (shape[0] == 1 || shape[0] < 0) && (shape[1] == 3 || shape[1] < 0) &&
                      is_side(shape[2]) && is_side(shape[3]);
    if (!fits) {
      throw InputError(
          name_.file,
          fmt::format("has {} inputs{}; a network that outlines objects has one, "
                      "1x3xHxW",
                      inputs.size(), inputs.empty() ? "" : ", the first of " + ShapeText(shape)));
    }
    size_ = {shape[3] < 0 ? kUsualSide : int(shape[3]), shape[2] < 0 ? kUsualSide : int(shape[2])};
    model_ = std::move(model);
  }

  Tensor InputOf(const Image8& image) const {
    // cv::Mat takes no const data; it is only read here.
    const cv::Mat whole(image.height, image.width, CV_8UC3,
                        const_cast<uint8_t*>(image.data.data()));
    cv::Mat scaled;
    cv::resize(whole, scaled, size_, 0, 0, cv::INTER_AREA);
    Tensor tensor;
    tensor.shape = {1, 3, size_.height, size_.width};
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < size_.height; ++y) {
        for (int x = 0; x < size_.width; ++x) {
          tensor.values.push_back(ToNetwork(values_, scaled.ptr(y)[3 * x + c], size_t(c)));
        }
      }
    }
    return tensor;
  }

  // The first output that is one picture.
  cv::Mat MaskIn(const std::vector<Tensor>& outputs) const {
    for (const Tensor& output : outputs) {
      std::vector<int64_t> shape = output.shape;
      std::erase(shape, 1);
      if (shape.size() != 2 || shape[0] == 0 || shape[1] == 0) continue;
      return cv::Mat(int(shape[0]), int(shape[1]), CV_32F, const_cast<float*>(output.values.data()))
          .clone();
    }
    throw InputError(name_.file, "has no output that is a mask, 1x1xHxW");
  }

  const NetworkName name_;
  const PixelValues values_;
  mutable std::mutex mutex_;
  mutable std::unique_ptr<OnnxModel> model_;
  mutable cv::Size size_;
};

class ProgramOutlines : public MaskNetwork {
 public:
  explicit ProgramOutlines(NetworkName name) : name_(std::move(name)), program_(name_.command) {}

  ScalarImage Outline(const Image8& image, const Image8& strokes,
                      const Monitor& monitor) const override {
    std::vector<const Image8*> images = {&image};
    if (!strokes.Empty()) images.push_back(&strokes);
    ScalarImage mask = program_.Ask(images, monitor);
    const bool is_bytes = std::ranges::any_of(mask.data, [](float v) { return v > 1; });
    for (float& v : mask.data) {
      if (!std::isfinite(v)) {
        throw InputError("'" + name_.command + "' wrote a mask with values that are not finite");
      }
      v = std::clamp(is_bytes ? v / 255 : v, 0.0f, 1.0f);
    }
    return mask;
  }

  std::string Identity() const override { return name_.text; }

 private:
  const NetworkName name_;
  NetworkProgram program_;
};

}  // namespace

std::unique_ptr<MaskNetwork> MakeMaskNetwork(const std::string& name) {
  NetworkName parsed = ParseNetworkName(name, {"provider", "values"});
  if (parsed.IsProgram()) return std::make_unique<ProgramOutlines>(std::move(parsed));
  return std::make_unique<OnnxOutlines>(std::move(parsed));
}

}  // namespace retint
