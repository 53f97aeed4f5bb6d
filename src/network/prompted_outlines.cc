// SPDX-License-Identifier: BSD-3-Clause
#include "network/prompted_outlines.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/option_name.h"
#include "network/mask_tensors.h"
#include "network/onnx_model.h"

namespace retint {
namespace {

enum class Role { kEmbedding, kPoints, kLabels, kMask, kHasMask, kImageSize };

// An input of the decoder.
struct Port {
  Role role;
  size_t output = 0;  // kEmbedding: which of the encoder's
};

class PromptedOutlines : public MaskNetwork {
 public:
  PromptedOutlines(NetworkName encoder, std::filesystem::path decoder)
      : name_(std::move(encoder)), decoder_file_(std::move(decoder)) {
    ValuesOf(name_, PixelValues::kImageNet);
    name_.OneOf("provider", "cpu", {"cpu"});
  }

  ScalarImage Outline(const Image8& image, const ObjectPrompt& prompt, const Image8&,
                      const Monitor& monitor) const override {
    CheckOption(!prompt.inside.empty() || prompt.rectangle,
                name_.text + ": this network outlines the object that you name: give " +
                    OptionName("point") + " or " + OptionName("rectangle"));
    const std::lock_guard lock(mutex_);
    Open();
    Embed(image, monitor);
    std::vector<Tensor> inputs = DecoderInputs(image, prompt);
    const std::vector<Tensor> outputs = decoder_->Run(std::move(inputs), monitor);
    const size_t prompts =
        prompt.inside.size() + prompt.outside.size() + (prompt.rectangle ? 2 : 0);
    cv::Mat found = MaskIn(outputs, prompts);
    MakeSure(&found);
    ScalarImage mask(image.width, image.height);
    cv::Mat out(image.height, image.width, CV_32F, mask.data.data());
    if (found.size() == out.size()) {
      found.copyTo(out);
    } else {  // of the encoder's picture
      cv::resize(found, found, canvas_, 0, 0, cv::INTER_LINEAR);
      cv::resize(found({0, 0, used_.width, used_.height}), out, out.size(), 0, 0, cv::INTER_LINEAR);
    }
    for (float& v : mask.data) v = std::clamp(v, 0.0f, 1.0f);
    return mask;
  }

  std::string Identity() const override {
    const std::lock_guard lock(mutex_);
    Open();
    return encoder_->Identity() + " and " + decoder_->Identity() + name_.SettingsText();
  }

 private:
  void Open() const {
    if (decoder_) return;
    const bool cpu_only = name_.settings.contains("provider");
    encoder_ = std::make_unique<OnnxModel>(name_.file, cpu_only);
    LookAtEncoder();
    auto decoder = std::make_unique<OnnxModel>(decoder_file_, cpu_only);
    LookAtDecoder(*decoder);
    decoder_ = std::move(decoder);
  }

  void LookAtEncoder() const {
    const auto& inputs = encoder_->inputs();
    std::vector<int64_t> shape = inputs.empty() ? std::vector<int64_t>() : inputs[0].shape;
    const std::string text = ShapeText(shape);
    if (shape.size() == 4 && (shape[0] == 1 || shape[0] < 0)) shape.erase(shape.begin());
    const bool fits = inputs.size() == 1 && inputs[0].is_tensor && shape.size() == 3;
    channels_last_ = fits && shape[0] != 3 && shape[2] == 3;
    if (fits && !channels_last_) std::rotate(shape.begin(), shape.begin() + 1, shape.end());
    if (!fits || (shape[2] != 3 && shape[2] >= 0) || !IsSide(shape[0]) || !IsSide(shape[1])) {
      throw InputError(name_.file,
                       fmt::format("has {} inputs{}; an encoder of pictures has one, "
                                   "1x3xHxW or HxWx3",
                                   inputs.size(), inputs.empty() ? "" : ", the first of " + text));
    }
    has_batch_ = inputs[0].shape.size() == 4;
    fixed_ = {int(shape[1]), int(shape[0])};
  }

  void LookAtDecoder(const OnnxModel& decoder) const {
    ports_.clear();
    const auto& embeddings = encoder_->outputs();
    bool has_points = false, has_labels = false;
    size_t bound = 0;
    for (const NetworkPort& port : decoder.inputs()) {
      const auto same = std::ranges::find(embeddings, port.name, &NetworkPort::name);
      const std::string& name = port.name;
      if (same != embeddings.end()) {
        ports_.push_back({Role::kEmbedding, size_t(same - embeddings.begin())});
        ++bound;
      } else if (name == "point_coords") {
        ports_.push_back({Role::kPoints});
        has_points = true;
      } else if (name == "point_labels") {
        ports_.push_back({Role::kLabels});
        has_labels = true;
      } else if (name == "mask_input") {
        ports_.push_back({Role::kMask});
      } else if (name == "has_mask_input") {
        ports_.push_back({Role::kHasMask});
      } else if (name == "orig_im_size") {
        ports_.push_back({Role::kImageSize});
      } else if (embeddings.size() == 1 && name.find("embed") != std::string::npos) {
        ports_.push_back({Role::kEmbedding, 0});  // exporters name the encoder's output freely
        ++bound;
      } else {
        throw InputError(decoder.file(),
                         fmt::format("its input {} is neither an output of {} nor one that exports "
                                     "of SAM have",
                                     name, encoder_->file().filename().string()));
      }
    }
    if (!has_points || !has_labels || bound == 0) {
      throw InputError(decoder.file(),
                       "is no decoder of SAM: it needs image_embeddings, point_coords and "
                       "point_labels");
    }
    stretches_ = bound > 1;
  }

  // Runs the encoder on an image, unless it is the last one.
  void Embed(const Image8& image, const Monitor& monitor) const {
    if (!embeddings_.empty() && image.width == image_.width && image.height == image_.height &&
        image.data == image_.data) {
      return;
    }
    embeddings_.clear();
    canvas_ = {fixed_.width < 0 ? kUsualSide : fixed_.width,
               fixed_.height < 0 ? kUsualSide : fixed_.height};
    used_ = canvas_;
    if (!stretches_) {
      const double scale =
          std::min(double(canvas_.width) / image.width, double(canvas_.height) / image.height);
      used_ = {std::max(1, int(std::lround(scale * image.width))),
               std::max(1, int(std::lround(scale * image.height)))};
    }
    if (channels_last_ && fixed_.width < 0 && fixed_.height < 0) canvas_ = used_;  // it pads itself
    cv::Mat scaled;
    const bool shrinks = used_.area() < image.width * image.height;
    cv::resize(MatOf(image), scaled, used_, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
    const PixelValues usual = channels_last_ ? PixelValues::k255 : PixelValues::kImageNet;
    Tensor picture = PictureTensor(scaled, canvas_, ValuesOf(name_, usual), channels_last_);
    if (channels_last_ && has_batch_) picture.shape.insert(picture.shape.begin(), 1);
    if (!channels_last_ && !has_batch_) picture.shape.erase(picture.shape.begin());
    std::vector<Tensor> inputs;
    inputs.push_back(std::move(picture));
    embeddings_ = encoder_->Run(std::move(inputs), monitor);
    image_ = image;
    if (channels_last_) {  // small masks cover the square that the network pads to
      const int side = std::max(canvas_.width, canvas_.height);
      canvas_ = {side, side};
    }
  }

  std::vector<Tensor> DecoderInputs(const Image8& image, const ObjectPrompt& prompt) const {
    Tensor points, labels;
    const Eigen::Array2d scale(double(used_.width) / image.width,
                               double(used_.height) / image.height);
    const auto add = [&](const Eigen::Vector2d& at, float label) {
      // The network adds the half itself.
      for (const double v : at.array() * scale - 0.5) points.values.push_back(float(v));
      labels.values.push_back(label);
    };
    for (const Eigen::Vector2d& at : prompt.inside) add(at, 1);
    for (const Eigen::Vector2d& at : prompt.outside) add(at, 0);
    if (prompt.rectangle) {
      add((*prompt.rectangle)[0], 2);
      add((*prompt.rectangle)[1], 3);
    }
    std::vector<Tensor> inputs;
    const auto& ports = decoder_->inputs();
    size_t count =
        labels.values.size() + (prompt.rectangle ? 0 : 1);  // SAM wants an empty one then
    for (size_t i = 0; i < ports.size(); ++i) {
      if (ports_[i].role != Role::kLabels || ports[i].shape.size() < 2 || ports[i].shape[1] < 0) {
        continue;
      }
      count = size_t(ports[i].shape[1]);
      if (count >= labels.values.size()) continue;
      throw InputError(decoder_file_, fmt::format("takes {} points at most, corners of the "
                                                  "rectangle among them",
                                                  count));
    }
    points.values.resize(2 * count, 0);
    labels.values.resize(count, -1);
    points.shape = {1, int64_t(count), 2};
    labels.shape = {1, int64_t(count)};
    for (size_t i = 0; i < ports.size(); ++i) {
      inputs.push_back(InputOf(ports_[i], ports[i].shape, points, labels));
      if (ports_[i].role == Role::kImageSize) {
        inputs.back() = {{2}, {float(image.height), float(image.width)}};
      }
    }
    return inputs;
  }

  Tensor InputOf(const Port& port, const std::vector<int64_t>& shape, const Tensor& points,
                 const Tensor& labels) const {
    switch (port.role) {
      case Role::kEmbedding:
        return embeddings_.at(port.output);
      case Role::kPoints:
        return points;
      case Role::kLabels:
        return labels;
      case Role::kHasMask:
        return {{1}, {0}};
      case Role::kImageSize:
        break;  // the caller's
      case Role::kMask: {
        constexpr int64_t kUsual = 256, kMost = 1 << 12;
        Tensor mask{{1, 1, kUsual, kUsual}, {}};
        for (size_t d = 2; shape.size() == 4 && d < 4; ++d) {
          if (shape[d] > 0) mask.shape[d] = std::min(shape[d], kMost);
        }
        mask.values.resize(size_t(mask.shape[2] * mask.shape[3]));
        return mask;
      }
    }
    return {};
  }

  // The best mask of the output "masks", or of the first that may be masks.
  cv::Mat MaskIn(const std::vector<Tensor>& outputs, size_t prompts) const {
    const auto& ports = decoder_->outputs();
    const Tensor *masks = nullptr, *scores = nullptr;
    bool is_named = false;
    for (size_t i = 0; i < outputs.size(); ++i) {
      const auto& shape = outputs[i].shape;
      const bool named = ports[i].name == "masks";
      if (shape.size() == 4 && shape[1] > 0 && shape[2] > 0 && shape[3] > 0 &&
          (!masks || (named && !is_named))) {
        masks = &outputs[i];
        is_named = named;
      } else if (shape.size() == 2) {
        scores = &outputs[i];
      }
    }
    if (!masks) throw InputError(decoder_file_, "has no output of masks, 1xMxHxW");
    // SAM's first mask of four is for prompts of several points, the others for one that means more
    // than one thing.
    const auto& shape = masks->shape;
    const size_t count = size_t(shape[1]), pixels = size_t(shape[2] * shape[3]);
    size_t best = 0;
    if (scores && scores->values.size() == count) {
      const auto& values = scores->values;
      const bool is_sam = count == 4;
      const auto first = values.begin() + (is_sam && prompts == 1 ? 1 : 0);
      const auto last = is_sam && prompts > 1 ? first + 1 : values.end();
      best = size_t(std::max_element(first, last) - values.begin());
    }
    return cv::Mat(int(shape[2]), int(shape[3]), CV_32F,
                   const_cast<float*>(masks->values.data() + best * pixels))
        .clone();
  }

  const NetworkName name_;  // of the encoder
  const std::filesystem::path decoder_file_;
  mutable std::mutex mutex_;  // of all below; a network runs once at a time
  mutable std::unique_ptr<OnnxModel> encoder_, decoder_;
  mutable bool channels_last_ = false, has_batch_ = false, stretches_ = false;
  mutable cv::Size fixed_;           // of the encoder's input; below 0: any
  mutable std::vector<Port> ports_;  // of each input of the decoder
  // Of the last image:
  mutable Image8 image_;
  mutable cv::Size canvas_, used_;  // the encoder's picture, and the part that the image fills
  mutable std::vector<Tensor> embeddings_;
};

}  // namespace

std::unique_ptr<MaskNetwork> MakePromptedOutlines(const NetworkName& encoder,
                                                  const std::filesystem::path& decoder) {
  return std::make_unique<PromptedOutlines>(encoder, decoder);
}

}  // namespace retint
