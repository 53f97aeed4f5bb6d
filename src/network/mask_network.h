// SPDX-License-Identifier: BSD-3-Clause
// Networks of the user's own that outline an object.
#pragma once

#include <memory>
#include <string>

#include "base/monitor.h"
#include "scene/image.h"

namespace retint {

class MaskNetwork {
 public:
  virtual ~MaskNetwork() = default;
  // How surely each pixel is of the object, in [0, 1], in the image's size. `strokes`, if it is not
  // empty, has the user's strokes: green on the object, red beside it, black elsewhere. InputError
  // for a network of no use, RunError for a program that fails.
  virtual ScalarImage Outline(const Image8& image, const Image8& strokes,
                              const Monitor& monitor) const = 0;
  // Names the network exactly, so that results can be told apart.
  virtual std::string Identity() const = 0;
};

// `name`: "onnx:FILE[,key=value...]" or "exec:COMMAND". OptionError for a bad name. The network is
// loaded, or the program started, when it is first needed.
//
// The network of a file finds the salient object, as ISNet does, without strokes. It takes an image
// [1, 3, H, W]; the picture is scaled to that size, or to 1024 x 1024 if the network takes any.
// Its first output of pixels is the mask, in [0, 1] or as log odds. Keys: provider=cpu, and
// values=half|255|1|signed|imagenet. `half` is -0.5 to 0.5, as ISNet takes it; U2-Net and BiRefNet
// take `imagenet`.
//
// A program reads a line "IMAGE<tab>OUTPUT", or "IMAGE<tab>STROKES<tab>OUTPUT" if there are strokes
// (network/program.h). Its numbers are in [0, 1], or else in [0, 255].
std::unique_ptr<MaskNetwork> MakeMaskNetwork(const std::string& name);

}  // namespace retint
