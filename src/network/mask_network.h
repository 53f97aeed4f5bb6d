// SPDX-License-Identifier: BSD-3-Clause
// Networks of the user's own that outline an object.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/monitor.h"
#include "scene/image.h"

namespace retint {

// Which object is meant. In pixels of the image; the middle of its first pixel is (0.5, 0.5).
struct ObjectPrompt {
  std::vector<Eigen::Vector2d> inside = {}, outside = {};
  std::optional<std::array<Eigen::Vector2d, 2>> rectangle = {};  // about the object: least, most

  bool Empty() const { return inside.empty() && outside.empty() && !rectangle; }
};

class MaskNetwork {
 public:
  virtual ~MaskNetwork() = default;
  // How surely each pixel is of the object, in [0, 1], in the image's size. `strokes`, if it is not
  // empty, is a picture of the prompt: green on the object, red beside it, a blue rectangle, black
  // elsewhere. InputError for a network of no use, OptionError if it needs a prompt and there is
  // none, RunError for a program that fails. Thread-safe.
  virtual ScalarImage Outline(const Image8& image, const ObjectPrompt& prompt,
                              const Image8& strokes, const Monitor& monitor) const = 0;
  // Names the network exactly, so that results can be told apart.
  virtual std::string Identity() const = 0;
};

// `name`: "onnx:FILE[,key=value...]", "onnx:ENCODER.onnx,DECODER.onnx[,key=value...]" or
// "exec:COMMAND". OptionError for a bad name. The network is loaded, or the program started, when
// it is first needed. Keys: provider=cpu, and values=half|255|1|signed|imagenet.
//
// One file finds the salient object, as ISNet does. It takes an image [1, 3, H, W]; the picture, or
// the prompt's rectangle with a tenth around it, is scaled to that size, or to 1024 x 1024 if the
// network takes any. Its first output of pixels is the mask, in [0, 1] or as log odds. Connected
// parts without a point inside are dropped, if another part has one. `half` is -0.5 to 0.5, as
// ISNet takes it; U2-Net and BiRefNet take `imagenet`.
//
// Two files outline the prompt's object, as exports of SAM and its successors do: the encoder
// runs once for an image, the decoder for each prompt (network/prompted_outlines.h).
//
// A program reads a line "IMAGE<tab>OUTPUT", or "IMAGE<tab>STROKES<tab>OUTPUT" if there are strokes
// (network/program.h). Its numbers are in [0, 1], or else in [0, 255].
std::unique_ptr<MaskNetwork> MakeMaskNetwork(const std::string& name);

}  // namespace retint
