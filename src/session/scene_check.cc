// SPDX-License-Identifier: BSD-3-Clause
#include "session/scene_check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "base/error.h"

namespace retint {
namespace {

constexpr size_t kNamesShown = 3;

std::string Fixed(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

double Median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Every step-th part of both sides, each of its pixels the mean of step x step.
PosedCamera Reduced(const PosedCamera& posed, int step) {
  const Camera& camera = posed.camera;
  return {Camera::Pinhole(camera.id, camera.width / step, camera.height / step, camera.fx() / step,
                          camera.fy() / step, camera.cx() / step, camera.cy() / step),
          posed.cam_from_world};
}

Image Reduced(const Image& image, int step) {
  Image small(image.width / step, image.height / step);
  const float weight = 1.0F / static_cast<float>(step * step);
  for (int y = 0; y < small.height * step; ++y) {
    for (int x = 0; x < small.width * step; ++x) {
      for (size_t c = 0; c < 3; ++c) {
        small.data[small.Index(x / step, y / step) + c] +=
            weight * image.data[image.Index(x, y) + c];
      }
    }
  }
  return small;
}

double Psnr(const Image& render, const Image& photo) {
  double sum = 0;
  for (size_t i = 0; i < render.data.size(); ++i) {
    const double difference = std::clamp(render.data[i], 0.0F, 1.0F) - photo.data[i];
    sum += difference * difference;
  }
  return -10 * std::log10(std::max(sum / static_cast<double>(render.data.size()), 1e-10));
}

void Compare(EditSession& session, const View& view, int longest_side, std::vector<double>* psnr,
             std::vector<double>* coverage) {
  const PosedCamera posed = session.reconstruction().Posed(view);
  const int side = std::max(posed.camera.width, posed.camera.height);
  const int step =
      std::max(1, std::min({side / longest_side, posed.camera.width, posed.camera.height}));
  RenderRequest request;
  request.alpha = true;
  request.cache = false;
  const RenderOutput output = session.renderer().Render(Reduced(posed, step), request);
  double sum = 0;
  for (const float alpha : output.alpha.data) sum += alpha;
  coverage->push_back(sum / static_cast<double>(std::max<size_t>(1, output.alpha.data.size())));
  if (!session.workspace().HasPhoto(view)) return;
  try {
    psnr->push_back(Psnr(output.rgb, Reduced(session.workspace().ReadPhoto(view), step)));
  } catch (const InputError&) {
    // Where it is wanted, its fault is named.
  }
}

}  // namespace

SceneCheck CheckScene(EditSession& session, Monitor& monitor, const SceneCheckOptions& options) {
  SceneCheck check;
  const std::vector<const View*> views = session.reconstruction().ViewsByName();
  check.views = static_cast<int>(views.size());
  for (const View* view : views) {
    if (!session.workspace().HasPhoto(*view)) check.missing_photos.push_back(view->name);
  }
  session.ShowSh(session.original().sh);
  std::vector<double> psnr, coverage;
  const int count = std::min(options.max_views, check.views);
  for (int i = 0; i < count; ++i) {
    monitor.Step("check", i, count);
    const auto at = static_cast<size_t>(i) * views.size() / static_cast<size_t>(count);
    Compare(session, *views[at], options.longest_side, &psnr, &coverage);
  }
  monitor.Step("check", count, count);
  check.compared = static_cast<int>(psnr.size());
  check.median_psnr = Median(psnr);
  check.median_coverage = Median(coverage);

  if (!check.missing_photos.empty()) {
    std::string line = "photos of " + std::to_string(check.missing_photos.size()) + " of " +
                       std::to_string(check.views) + " views are missing: ";
    for (size_t i = 0; i < std::min(kNamesShown, check.missing_photos.size()); ++i) {
      line += (i > 0 ? ", " : "") + check.missing_photos[i];
    }
    if (check.missing_photos.size() > kNamesShown) line += ", ...";
    check.warnings.push_back(line);
  }
  if (check.median_coverage < options.min_coverage) {
    check.warnings.push_back("the splat covers only " + Fixed(100 * check.median_coverage, 0) +
                             " % of the views: it seems to be in another frame than the workspace");
  } else if (check.median_psnr < options.min_psnr) {
    check.warnings.push_back("renders and photos disagree (" + Fixed(check.median_psnr, 1) +
                             " dB): the splat seems to be in another frame than the workspace, or "
                             "of another scene");
  }
  return check;
}

}  // namespace retint
