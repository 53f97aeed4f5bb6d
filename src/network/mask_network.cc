// SPDX-License-Identifier: BSD-3-Clause
#include "network/mask_network.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "network/mask_tensors.h"
#include "network/network_name.h"
#include "network/onnx_model.h"
#include "network/pixel_values.h"
#include "network/program.h"
#include "network/prompted_outlines.h"

namespace retint {
namespace {

// The rectangle with a tenth of its size around it, within the image: a network needs to see beside
// the object.
cv::Rect AreaOf(const ObjectPrompt& prompt, const cv::Rect& whole) {
  if (!prompt.rectangle) return whole;
  const Eigen::Array2d least = (*prompt.rectangle)[0], most = (*prompt.rectangle)[1];
  constexpr double kMargin = 0.1;
  const Eigen::Array2d low = (least - kMargin * (most - least)).floor();
  const Eigen::Array2d high = (most + kMargin * (most - least)).ceil();
  const cv::Rect area = whole & cv::Rect(cv::Point(int(low.x()), int(low.y())),
                                         cv::Point(int(high.x()), int(high.y())));
  return area.empty() ? whole : area;
}

// Without the connected parts that have no point inside, if another has one.
void KeepNamedParts(const std::vector<Eigen::Vector2d>& inside, cv::Mat* mask) {
  cv::Mat parts;
  const int count = cv::connectedComponents(*mask >= 0.5, parts);
  std::vector<bool> is_named(size_t(count), false);
  for (const Eigen::Vector2d& point : inside) {
    const cv::Point at(int(point.x()), int(point.y()));
    if (cv::Rect(cv::Point(), mask->size()).contains(at)) {
      is_named[size_t(parts.at<int>(at))] = true;
    }
  }
  is_named[0] = false;  // the background
  if (std::ranges::find(is_named, true) == is_named.end()) return;
  for (int part = 1; part < count; ++part) {
    if (!is_named[size_t(part)]) mask->setTo(0, parts == part);
  }
}

class OnnxOutlines : public MaskNetwork {
 public:
  explicit OnnxOutlines(NetworkName name)
      : name_(std::move(name)), values_(ValuesOf(name_, PixelValues::kHalf)) {
    name_.OneOf("provider", "cpu", {"cpu"});
  }

  ScalarImage Outline(const Image8& image, const ObjectPrompt& prompt, const Image8&,
                      const Monitor& monitor) const override {
    const std::lock_guard lock(mutex_);
    Open();
    const cv::Rect area = AreaOf(prompt, {0, 0, image.width, image.height});
    cv::Mat scaled;
    cv::resize(MatOf(image)(area), scaled, size_, 0, 0, cv::INTER_AREA);
    std::vector<Tensor> inputs = {PictureTensor(scaled, size_, values_, false)};
    cv::Mat found = MaskIn(model_->Run(std::move(inputs), monitor));
    MakeSure(&found);
    ScalarImage mask(image.width, image.height);
    cv::Mat out(image.height, image.width, CV_32F, mask.data.data());
    cv::resize(found, found, area.size(), 0, 0, cv::INTER_LINEAR);
    found.copyTo(out(area));
    for (float& v : mask.data) v = std::clamp(v, 0.0f, 1.0f);
    KeepNamedParts(prompt.inside, &out);
    return mask;
  }

  std::string Identity() const override {
    const std::lock_guard lock(mutex_);
    Open();
    return model_->Identity() + name_.SettingsText();
  }

 private:
  void Open() const {
    if (model_) return;
    auto model = std::make_unique<OnnxModel>(name_.file, name_.settings.contains("provider"));
    const auto& inputs = model->inputs();
    const std::vector<int64_t> shape = inputs.empty() ? std::vector<int64_t>() : inputs[0].shape;
    const bool fits = inputs.size() == 1 && inputs[0].is_tensor && shape.size() == 4 &&
                      (shape[0] == 1 || shape[0] < 0) && (shape[1] == 3 || shape[1] < 0) &&
                      IsSide(shape[2]) && IsSide(shape[3]);
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

  ScalarImage Outline(const Image8& image, const ObjectPrompt&, const Image8& strokes,
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
  constexpr std::string_view kBetween = ".onnx,";
  const std::string files = parsed.file.string();
  const size_t at = files.find(kBetween);
  if (at == std::string::npos) return std::make_unique<OnnxOutlines>(std::move(parsed));
  parsed.file = files.substr(0, at + kBetween.size() - 1);
  const std::string decoder = files.substr(at + kBetween.size());
  CheckOption(!decoder.empty(), name + ": the decoder's file is missing behind the comma");
  return MakePromptedOutlines(parsed, decoder);
}

}  // namespace retint
