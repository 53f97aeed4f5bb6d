// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/select_options.h"

namespace retint {

void SelectOptions::DescribeDepth(OptionList& list) {
  list.push_back({.name = "depth_method",
                  .member = ChoiceOf(depth_method, DepthMethods()),
                  .help = "how depth is found: " + DepthMethodsHelp(),
                  .tier = OptionTier::kOccasional});
  depth.Describe(list);
}

void SelectOptions::DescribeCloud(OptionList& list) {
  cloud.Describe(list);
  list.push_back({.name = "register_cloud",
                  .member = &register_cloud,
                  .help = "move the cloud onto the sparse points",
                  .tier = OptionTier::kExpert});
  registration.Describe(list);
}

void SelectOptions::Describe(OptionList& list) {
  DescribeDepth(list);
  DescribeCloud(list);
}

void SelectOptions::Check() const {
  CheckRanges(*this);
  depth.Check();
}

}  // namespace retint
