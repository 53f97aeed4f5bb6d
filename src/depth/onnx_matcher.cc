// SPDX-License-Identifier: BSD-3-Clause
#include "depth/onnx_matcher.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/median.h"
#include "network/onnx_model.h"
#include "network/pixel_values.h"

namespace retint {
namespace {

constexpr int kProbeShift = 8;                        // pixels
constexpr int kProbeWidth = 256, kProbeHeight = 192;  // of networks for any size

// The images that an input of the network gets.
struct Role {
  bool left = false, right = false;  // both: one after the other, in one input
  bool half = false;                 // of the size that others have
  int channels = 3;
  cv::Size size;  // {0, 0}: any
};

cv::Mat MatOf(const Image8& image) {
  // cv::Mat takes no const data; it is only read here.
  return {image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.data.data())};
}

cv::Mat Resized(const cv::Mat& image, cv::Size size) {
  if (image.size() == size) return image;
  cv::Mat out;
  const bool shrinks = size.area() < image.size().area();
  cv::resize(image, out, size, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  return out;
}

int RoundUp(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }

// A pattern that looks the same from both cameras: noise of several sizes in three colors, in
// [0, 255]. A network may be tested on a picture that has nothing to match; on this there is.
Image8 TestTexture(int width, int height, uint64_t seed = 8) {
  cv::RNG random(seed);
  cv::Mat sum(height, width, CV_32FC3, cv::Scalar::all(0));
  double total = 0;
  for (int cell = 3; cell <= 48; cell *= 2) {
    cv::Mat noise(height / cell + 2, width / cell + 2, CV_32FC3), layer;
    random.fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::resize(noise, layer, {width, height}, 0, 0, cv::INTER_CUBIC);
    sum += layer;
    total += 1;
  }
  cv::Mat bytes;
  sum.convertTo(bytes, CV_8UC3, 1.6 / total, -0.3 * 255);  // more contrast than a mean has
  return Image8::Of(width, height, bytes.ptr());
}

Image8 ColumnsOf(const Image8& image, int first, int count) {
  Image8 out(count, image.height);
  for (int y = 0; y < image.height; ++y) {
    std::copy_n(&image(first, y), size_t(count) * 3, &out(0, y));
  }
  return out;
}

// Near squares before a far ground. A network that gets other values than it expects may still see
// a large plain shift, but it misses small things.
constexpr int kNear = 12, kFar = 4, kSquare = 24;  // pixels

bool IsOnSquare(int x, int y) { return x / kSquare % 2 == 1 && y / kSquare % 2 == 1; }

// What the left camera sees of them, or the right one.
Image8 TestSquares(cv::Size size, bool is_right) {
  const Image8 near = TestTexture(size.width + kNear, size.height, 9);
  const Image8 far = TestTexture(size.width + kNear, size.height);
  Image8 seen(size.width, size.height);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const int x_near = is_right ? x + kNear : x, x_far = is_right ? x + kFar : x;
      const bool on_square = IsOnSquare(x_near, y);
      std::copy_n(on_square ? &near(x_near, y) : &far(x_far, y), 3, &seen(x, y));
    }
  }
  return seen;
}

// Without the borders, which see less.
cv::Rect InnerOf(cv::Size size) {
  return {size.width / 4, size.height / 4, size.width / 2, size.height / 2};
}

class OnnxMatcher : public StereoMatcher {
 public:
  explicit OnnxMatcher(const NetworkName& name) : name_(name) {
    name.OneOf("provider", "cpu", {"cpu"});
    pad_ = int(name.Number("pad", 32, 1, 1024));
    if (name.settings.contains("scale")) scale_ = name.Number("scale", 1, -1e6, 1e6);
    CheckOption(scale_ != 0.0, name.text + ": scale must not be 0");
    const PixelValues values = ValuesOf(name, PixelValues::k255);
    if (name.settings.contains("values")) values_ = values;
  }

  StereoMatch Match(const Image8& left, const Image8& right, const DisparityRange&,
                    const Monitor& monitor) const override {
    CheckOption(left.width == right.width && left.height == right.height && !left.Empty(),
                "a stereo pair must be two images of one size");
    const std::lock_guard lock(mutex_);
    Load(monitor);
    StereoMatch match;
    match.disparity = Disparity(left, right, *values_, monitor);
    for (float& s : match.disparity.data) {
      s *= float(*scale_);
      if (s <= 0) s = -1;
    }
    return match;
  }

  std::string Identity() const override {
    const std::lock_guard lock(mutex_);
    Open();
    return model_->Identity() + name_.SettingsText();
  }

 private:
  [[noreturn]] void Fail(const std::string& fault) const { throw InputError(name_.file, fault); }

  void Open() const {
    if (model_) return;
    auto model = std::make_unique<OnnxModel>(name_.file, name_.settings.contains("provider"));
    std::swap(model_, model);
    try {
      FindRoles();
    } catch (const Error&) {
      model_.reset();
      throw;
    }
  }

  // So that it can match.
  void Load(const Monitor& monitor) const {
    Open();
    if (!values_ || !scale_) Probe(monitor);
  }

  // Of an input [1, C, H, W].
  Role RoleOf(const NetworkPort& port, bool both) const {
    const auto& shape = port.shape;
    const bool fits = port.is_tensor && shape.size() == 4 && (shape[0] == 1 || shape[0] < 0);
    const int64_t per_image = fits && both && shape[1] > 0 ? shape[1] / 2 : fits ? shape[1] : 0;
    if (!fits || (both && shape[1] % 2 == 1) ||
        (shape[1] > 0 && per_image != 1 && per_image != 3) || shape[1] == 0) {
      Fail(fmt::format("its input {} is {}, not {} of images (1x{}xHxW)", port.name,
                       ShapeText(shape), both ? "a pair" : "one", both ? "6 or 1x2" : "3 or 1x1"));
    }
    constexpr int64_t kMostPixels = 1 << 14;  // a side
    if ((shape[2] < 0) != (shape[3] < 0) || shape[2] == 0 || shape[3] == 0 ||
        std::max(shape[2], shape[3]) > kMostPixels) {
      Fail(fmt::format("its input {} is {}: no size for images", port.name, ShapeText(shape)));
    }
    Role role;
    role.channels = shape[1] < 0 ? 3 : int(per_image);
    if (shape[2] > 0) role.size = {int(shape[3]), int(shape[2])};
    return role;
  }

  void FindRoles() const {
    const auto& ports = model_->inputs();
    roles_.clear();
    if (ports.size() != 1 && ports.size() != 2 && ports.size() != 4) {
      Fail(fmt::format("has {} inputs; a stereo network has 1, 2 or 4", ports.size()));
    }
    for (size_t i = 0; i < ports.size(); ++i) {
      Role role = RoleOf(ports[i], ports.size() == 1);
      role.left = ports.size() == 1 || i % 2 == 0;
      role.right = ports.size() == 1 || i % 2 == 1;
      roles_.push_back(role);
    }
    for (size_t i = 0; i + 1 < ports.size(); i += 2) {  // names may say otherwise
      if (ports[i].name.find("right") == std::string::npos) continue;
      std::swap(roles_[i].left, roles_[i + 1].left);
      std::swap(roles_[i].right, roles_[i + 1].right);
    }
    if (ports.size() == 4) {
      const bool last = roles_[2].size.area() < roles_[0].size.area() ||
                        ports[2].name.find("init") != std::string::npos;
      for (const size_t i : {0, 1}) roles_[i + (last ? 2 : 0)].half = true;
    }
    full_ = roles_[ports.size() == 4 && roles_[0].half ? 2 : 0].size;
    for (const Role& role : roles_) {
      if (!role.half && role.size != full_) Fail("its inputs have different sizes");
    }
  }

  Tensor TensorOf(const Role& role, const cv::Mat& left, const cv::Mat& right,
                  PixelValues values) const {
    cv::Size size = left.size();
    if (role.half) size = role.size == cv::Size() ? size / 2 : role.size;
    Tensor tensor;
    const int images = int(role.left) + int(role.right);
    tensor.shape = {1, images * role.channels, size.height, size.width};
    tensor.values.reserve(size_t(tensor.shape[1]) * size_t(size.area()));
    for (const bool is_right : {false, true}) {
      if (!(is_right ? role.right : role.left)) continue;
      cv::Mat image = Resized(is_right ? right : left, size);
      if (role.channels == 1) cv::cvtColor(image, image, cv::COLOR_RGB2GRAY);
      for (int c = 0; c < role.channels; ++c) {
        for (int y = 0; y < size.height; ++y) {
          const uint8_t* row = image.ptr(y);
          for (int x = 0; x < size.width; ++x) {
            tensor.values.push_back(ToNetwork(values, row[x * role.channels + c], size_t(c)));
          }
        }
      }
    }
    return tensor;
  }

  // The pixels of the output that holds the disparity, [size.height, size.width].
  cv::Mat TakeOutput(std::vector<Tensor>& tensors, cv::Size size) const {
    Tensor* found = nullptr;
    bool is_named = false;
    std::string shapes;
    for (size_t i = 0; i < tensors.size(); ++i) {
      const std::string& name = model_->outputs()[i].name;
      std::vector<int64_t> shape = tensors[i].shape;
      shapes += (shapes.empty() ? "" : ", ") + name + " " + ShapeText(shape);
      std::erase(shape, 1);
      const bool has_vertical = shape.size() == 3 && shape[0] == 2;  // of a flow, the second part
      if (shape.size() != 2 && !has_vertical) continue;
      if (shape.end()[-2] != size.height || shape.end()[-1] != size.width) continue;
      const bool names_it = name.find("disp") != std::string::npos;
      if (is_named && !names_it) continue;
      found = &tensors[i];
      is_named = names_it;
    }
    if (!found) {
      constexpr size_t kMost = 200;
      Fail(fmt::format("has no output of the size of its input, {}x{} (width x height), but {}",
                       size.width, size.height, shapes.substr(0, kMost)));
    }
    return cv::Mat(size, CV_32F, found->values.data()).clone();
  }

  // In pixels of the pair, without the scale.
  ScalarImage Disparity(const Image8& left, const Image8& right, PixelValues values,
                        const Monitor& monitor) const {
    const cv::Size given(left.width, left.height);
    const bool is_fixed = full_ != cv::Size();
    const auto fit = [&](const Image8& image) {
      if (is_fixed) return Resized(MatOf(image), full_);
      cv::Mat out;
      cv::copyMakeBorder(MatOf(image), out, 0, RoundUp(image.height, pad_) - image.height, 0,
                         RoundUp(image.width, pad_) - image.width, cv::BORDER_REPLICATE);
      return out;
    };
    const cv::Mat first = fit(left), second = fit(right);
    std::vector<Tensor> inputs;
    for (const Role& role : roles_) inputs.push_back(TensorOf(role, first, second, values));
    std::vector<Tensor> outputs = model_->Run(std::move(inputs), monitor);
    cv::Mat found = TakeOutput(outputs, first.size());
    ScalarImage disparity(given.width, given.height);
    cv::Mat out(given, CV_32F, disparity.data.data());
    if (is_fixed) {
      cv::resize(found, out, given, 0, 0, cv::INTER_LINEAR);
      out *= double(given.width) / full_.width;
    } else {
      found({0, 0, given.width, given.height}).copyTo(out);
    }
    return disparity;
  }

  // The network's answer to the test pair.
  struct Answer {
    double median = 0;
    double spread = std::numeric_limits<double>::infinity();  // relative to the median
  };

  cv::Size TestSize() const {
    if (full_ != cv::Size()) return full_;
    return {RoundUp(kProbeWidth, pad_), RoundUp(kProbeHeight, pad_)};
  }

  Answer Ask(PixelValues values, int shift, const Monitor& monitor) const {
    const cv::Size size = TestSize();
    const Image8 texture = TestTexture(size.width + shift, size.height);
    const ScalarImage found = Disparity(ColumnsOf(texture, 0, size.width),
                                        ColumnsOf(texture, shift, size.width), values, monitor);
    std::vector<float> inner;
    const cv::Rect area = InnerOf(size);
    for (int y = area.y; y < area.br().y; ++y) {
      for (int x = area.x; x < area.br().x; ++x) inner.push_back(found(x, y));
    }
    Answer answer;
    answer.median = Median(inner);
    for (float& value : inner) value = std::abs(value - float(answer.median));
    if (answer.median != 0) answer.spread = Median(inner) / std::abs(answer.median);
    return answer;
  }

  // Pixels by which the disparity of the squares' pair is off, on average. `factor`: from answers
  // to pixels.
  double ErrorOnSquares(PixelValues values, double factor, const Monitor& monitor) const {
    const cv::Size size = TestSize();
    const ScalarImage found =
        Disparity(TestSquares(size, false), TestSquares(size, true), values, monitor);
    const cv::Rect area = InnerOf(size);
    double sum = 0;
    for (int y = area.y; y < area.br().y; ++y) {
      for (int x = area.x; x < area.br().x; ++x) {
        const double error = factor * found(x, y) - (IsOnSquare(x, y) ? kNear : kFar);
        sum += std::min(std::abs(error), double(kNear - kFar));
      }
    }
    return sum / area.area();
  }

  void Probe(const Monitor& monitor) const {
    constexpr double kMostSpread = 0.2;
    std::vector<PixelValues> candidates = {PixelValues::k255, PixelValues::k1, PixelValues::kSigned,
                                           PixelValues::kImageNet};
    if (values_) candidates = {*values_};
    Answer best;
    double least = std::numeric_limits<double>::infinity();
    PixelValues values = candidates.front();
    std::string answers;
    for (const PixelValues candidate : candidates) {
      const Answer answer = Ask(candidate, kProbeShift, monitor);
      answers += fmt::format("{}{:.3g} with values={}", answers.empty() ? "" : ", ", answer.median,
                             NameOf(candidate));
      if (answer.spread > kMostSpread) continue;
      const double error = ErrorOnSquares(candidate, kProbeShift / answer.median, monitor);
      if (error >= least) continue;
      least = error;
      best = answer;
      values = candidate;
    }
    // Something else than disparities does not follow the shift.
    const bool follows = best.spread <= kMostSpread &&
                         std::abs(Ask(values, 0, monitor).median) < 0.3 * std::abs(best.median);
    if (!follows) {
      Fail(
          fmt::format("does not see that a test pair is shifted by {} pixels, but {}; if it is a "
                      "stereo network, name its values= and scale=",
                      kProbeShift, answers));
    }
    values_ = values;
    if (scale_) return;
    // A network that answers in pixels is off by a little, and its answers need no factor.
    const double factor = kProbeShift / best.median;
    const bool in_pixels = std::abs(std::abs(factor) - 1) < 0.3;
    scale_ = in_pixels ? std::copysign(1.0, factor) : factor;
  }

  const NetworkName name_;
  int pad_ = 32;
  mutable std::mutex mutex_;  // for the members below; a network runs once at a time
  mutable std::unique_ptr<OnnxModel> model_;
  mutable std::vector<Role> roles_;  // of each input
  mutable cv::Size full_;            // of inputs of a fixed size, {0, 0} of others
  mutable std::optional<PixelValues> values_;
  mutable std::optional<double> scale_;
};

}  // namespace

NetworkName ParseStereoName(const std::string& text) {
  return ParseNetworkName(text, {"pad", "provider", "scale", "values"});
}

std::unique_ptr<StereoMatcher> MakeOnnxMatcher(const NetworkName& name) {
  return std::make_unique<OnnxMatcher>(name);
}

}  // namespace retint
