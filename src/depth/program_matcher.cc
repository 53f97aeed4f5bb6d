// SPDX-License-Identifier: BSD-3-Clause
#include "depth/program_matcher.h"

#include <cmath>

#include "base/error.h"
#include "network/program.h"

namespace retint {
namespace {

class ProgramMatcher : public StereoMatcher {
 public:
  explicit ProgramMatcher(const NetworkName& name) : name_(name), program_(name.command) {}

  StereoMatch Match(const Image8& left, const Image8& right, const DisparityRange&,
                    const Monitor& monitor) const override {
    CheckOption(left.width == right.width && left.height == right.height && !left.Empty(),
                "a stereo pair must be two images of one size");
    StereoMatch match;
    match.disparity = program_.Ask({&left, &right}, monitor);
    for (float& s : match.disparity.data) {
      if (!std::isfinite(s) || s <= 0) s = -1;
    }
    return match;
  }

  std::string Identity() const override { return name_.text; }

 private:
  const NetworkName name_;
  NetworkProgram program_;
};

}  // namespace

std::unique_ptr<StereoMatcher> MakeProgramMatcher(const NetworkName& name) {
  return std::make_unique<ProgramMatcher>(name);
}

}  // namespace retint
