// SPDX-License-Identifier: BSD-3-Clause
// From painted pixels to a registered cloud and to masks on every view.
#include <utility>

#include "base/error.h"
#include "session/edit_session.h"

namespace retint {

void SelectOptions::DescribeDepth(OptionList& list) {
  list.push_back({.name = "method",
                  .member = ChoiceOf(method, DepthMethods()),
                  .help = "how depth is found: " + DepthMethodsHelp(),
                  .flag = "--method"});
  depth.Describe(list);
}

void SelectOptions::DescribeCloud(OptionList& list) {
  cloud.Describe(list);
  list.push_back({.name = "register_cloud",
                  .member = &register_cloud,
                  .help = "move the cloud onto the sparse points",
                  .flag = "--registration"});
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

DepthEstimate EditSession::EstimateDepth(const PosedCamera& view, const SelectOptions& options,
                                         Monitor& monitor) {
  const StageClock::Lap lap(clock_, "depth");
  monitor.Step("depth", 0, 1);
  renderer_->SetSh(model_.sh);
  DepthEstimate estimate =
      MakeDepthEstimator(options.method, *renderer_, &workspace_, options.depth)
          ->Estimate(view, monitor);
  monitor.Step("depth", 1, 1);
  return estimate;
}

SelectionResult EditSession::Select(const std::vector<PaintedView>& painted,
                                    const SelectOptions& options, Monitor& monitor) {
  options.Check();
  CheckOption(!painted.empty(), "no view is painted");
  SelectionResult result;
  for (const PaintedView& view : painted) {
    PaintedReport report;
    report.view = view.name;
    DepthEstimate depth = EstimateDepth(view.camera, options, monitor);
    report.depth_method = depth.method;
    report.depth_reason = depth.reason;
    report.valid_fraction = depth.valid_fraction;

    SelectionCloud cloud;
    {
      const StageClock::Lap lap(clock_, "cloud");
      monitor.Step("cloud", 0, 1);
      const Image image = renderer_->Render(view.camera).rgb;
      cloud = MakeCloud(view.camera, view.name, view.mask, depth.depth, depth.valid, image,
                        options.cloud, &report.cloud, &renderer_->backend());
      if (options.keep_raw) {
        CloudOptions raw = options.cloud;
        raw.outlier_neighbors = 0;
        Append(result.cloud_raw,
               MakeCloud(view.camera, view.name, view.mask, depth.depth, depth.valid, image, raw));
      }
      monitor.Step("cloud", 1, 1);
    }
    if (options.register_cloud) {
      const StageClock::Lap lap(clock_, "registration");
      monitor.Step("registration", 0, 1);
      report.registration =
          Register(cloud, view.camera, reconstruction().FindView(view.name), view.mask, depth.depth,
                   reconstruction(), options.registration);
      monitor.Step("registration", 1, 1);
    } else {
      report.registration.reason = "switched off";
    }
    Append(result.cloud, cloud);
    result.depths.push_back(std::move(depth));
    result.painted.push_back(std::move(report));
  }
  return result;
}

ProjectedMasks EditSession::Project(const SelectionCloud& cloud,
                                    const std::vector<PaintedView>& painted,
                                    const ProjectorOptions& options, Monitor& monitor) {
  options.Check();
  const StageClock::Lap lap(clock_, "projection");
  monitor.Step("projection", 0, 1);
  renderer_->SetSh(model_.sh);
  ProjectedMasks masks = ProjectMasks(cloud, painted, reconstruction(),
                                      reconstruction().ViewsByName(), *renderer_, options, monitor);
  monitor.Step("projection", 1, 1);
  return masks;
}

}  // namespace retint
