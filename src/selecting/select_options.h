// SPDX-License-Identifier: BSD-3-Clause
// Options of the path from painted pixels to a registered cloud.
#pragma once

#include <string>

#include "depth/factory.h"
#include "selection/mask_projector.h"
#include "selection/registration.h"
#include "selection/selection_cloud.h"

namespace retint {

struct SelectOptions {
  std::string depth_method = "stereo-hv";  // one of DepthMethods()
  DepthOptions depth;
  CloudOptions cloud;
  bool register_cloud = true;  // false: the cloud stays where its depth put it
  RegistrationOptions registration;
  bool keep_raw = false;  // fill SelectionResult::cloud_raw
  void Describe(OptionList& list);
  void DescribeDepth(OptionList& list);  // the method and its options
  void DescribeCloud(OptionList& list);  // the rest
  void Check() const;
};

}  // namespace retint
