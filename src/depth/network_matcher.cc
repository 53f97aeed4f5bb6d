// SPDX-License-Identifier: BSD-3-Clause
#include "depth/network_matcher.h"

#include <cstdlib>
#include <map>
#include <mutex>

#include "base/error.h"
#include "base/option_name.h"
#include "depth/onnx_matcher.h"
#include "depth/program_matcher.h"

namespace retint {

std::shared_ptr<const StereoMatcher> MakeNetworkMatcher(const std::string& name) {
  using Matchers = std::map<std::string, std::shared_ptr<const StereoMatcher>>;
  static std::mutex mutex;
  static Matchers programs;               // end with us
  static auto& networks = *new Matchers;  // ONNX Runtime is gone by the time we end
  const NetworkName parsed = ParseStereoName(name);
  const std::lock_guard lock(mutex);
  auto& matcher = (parsed.IsProgram() ? programs : networks)[name];
  if (!matcher && parsed.IsProgram()) matcher = MakeProgramMatcher(parsed);
  if (!matcher) matcher = MakeOnnxMatcher(parsed);
  return matcher;
}

std::shared_ptr<const StereoMatcher> NetworkOf(const StereoHvOptions& options) {
  if (options.network) return options.network;
  const char* const name = std::getenv("RETINT_MATCHER");
  CheckOption(name && *name, "there is no network to match with: name one by " +
                                 OptionName("matcher", "onnx:FILE") +
                                 ", or in the environment variable RETINT_MATCHER");
  return MakeNetworkMatcher(name);
}

}  // namespace retint
