// SPDX-License-Identifier: BSD-3-Clause
#include "matcher.h"

#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

#include "arrays.h"
#include "base/error.h"
#include "depth/network_matcher.h"

namespace retint::python {
namespace {

// A function in Python, which any thread may let go.
class Function {
 public:
  // Holds the lock of Python, as every call does.
  Function(const char* kind, py::object function)
      : function_(std::move(function)),
        name_(std::string(kind) + " " + py::repr(function_).cast<std::string>()) {}
  ~Function() {
    const py::gil_scoped_acquire locked;
    function_ = {};
  }
  Function(const Function&) = delete;
  Function& operator=(const Function&) = delete;

  template <typename... Args>
  py::object operator()(Args&&... args) const {
    return function_(std::forward<Args>(args)...);
  }
  const std::string& name() const { return name_; }

 private:
  py::object function_;
  const std::string name_;
};

class FunctionMatcher : public StereoMatcher {
 public:
  explicit FunctionMatcher(py::object function) : function_("matcher", std::move(function)) {}

  StereoMatch Match(const Image8& left, const Image8& right, const DisparityRange&,
                    const Monitor&) const override {
    const py::gil_scoped_acquire locked;
    const py::object answer = function_(FromPixels(Image8(left)), FromPixels(Image8(right)));
    const auto array = Floats::ensure(answer);
    if (!array) {
      PyErr_Clear();
      throw OptionError(function_.name() + " returned no array of numbers");
    }
    RequireShape(array, {left.height, left.width}, "the disparity that matcher returned");
    StereoMatch match;
    match.disparity = ScalarImage::Of(left.width, left.height, array.data());
    for (float& s : match.disparity.data) {
      if (!std::isfinite(s) || s <= 0) s = -1;
    }
    return match;
  }

  std::string Identity() const override { return function_.name(); }

 private:
  const Function function_;
};

class FunctionOutlines : public MaskNetwork {
 public:
  explicit FunctionOutlines(py::object function) : function_("network", std::move(function)) {}

  ScalarImage Outline(const Image8& image, const ObjectPrompt& prompt, const Image8&,
                      const Monitor&) const override {
    CheckOption(prompt.Empty(),
                "a function takes no points and no rectangle: let it know them itself");
    const py::gil_scoped_acquire locked;
    const Mask mask = ToMask(function_(FromPixels(Image8(image))), image.width, image.height);
    ScalarImage sure(image.width, image.height);
    for (size_t p = 0; p < sure.data.size(); ++p) sure.data[p] = float(mask.data[p]) / 255;
    return sure;
  }

  std::string Identity() const override { return function_.name(); }

 private:
  const Function function_;
};

}  // namespace

std::shared_ptr<const MaskNetwork> ToMaskNetwork(const py::object& network) {
  if (network.is_none()) return nullptr;
  if (py::isinstance<py::str>(network)) return MakeMaskNetwork(network.cast<std::string>());
  CheckOption(PyCallable_Check(network.ptr()) != 0,
              "network is 'onnx:FILE', 'exec:COMMAND' or a function of an image [H, W, 3]");
  return std::make_shared<FunctionOutlines>(network);
}

void TakeMatcher(py::kwargs& keywords, StereoHvOptions& options) {
  if (keywords.contains("onnx_runtime")) {
    const std::string path = ToPath(keywords.attr("pop")("onnx_runtime")).string();
    setenv("RETINT_ONNX_RUNTIME", path.c_str(), 1);
  }
  if (!keywords.contains("matcher")) return;
  const py::object matcher = keywords["matcher"];
  if (py::isinstance<py::str>(matcher)) {
    const auto name = matcher.cast<std::string>();
    if (name.find(':') == std::string::npos) return;  // the option's own values
    options.network = MakeNetworkMatcher(name);
  } else {
    CheckOption(PyCallable_Check(matcher.ptr()) != 0,
                "matcher is 'census', 'sgbm', 'onnx:FILE', 'exec:COMMAND' or a function of two "
                "images [H, W, 3]");
    options.network = std::make_shared<FunctionMatcher>(matcher);
  }
  keywords["matcher"] = "network";
}

}  // namespace retint::python
