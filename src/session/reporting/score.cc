// SPDX-License-Identifier: BSD-3-Clause
#include "session/reporting/score.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>

#include <Eigen/Core>

#include "base/error.h"
#include "base/parallel.h"
#include "colmap_io/image_io.h"
#include "scene/mask_pixels.h"
#include "session/reporting/score_layout.h"
#include "session/reporting/score_report.h"

namespace retint {
namespace {

Mask ReadTruth(const std::filesystem::path& path) {
  Mask mask = ReadMask(path);
  const uint8_t largest = *std::max_element(mask.data.begin(), mask.data.end());
  if (!IsInside(largest)) {
    for (uint8_t& value : mask.data) value = value > 0 ? 255 : 0;
  }
  return mask;
}

Mask ResizedTo(const Mask& mask, int width, int height) {
  if (mask.width == width && mask.height == height) return mask;
  Mask resized(width, height);
  for (int y = 0; y < height; ++y) {
    const int from_y = int((2 * int64_t(y) + 1) * mask.height / (2 * int64_t(height)));
    for (int x = 0; x < width; ++x) {
      const int from_x = int((2 * int64_t(x) + 1) * mask.width / (2 * int64_t(width)));
      resized(x, y) = mask(from_x, from_y);
    }
  }
  return resized;
}

Image Edited(const Image& before, const ColorEdit& edit) {
  const CompiledEdit compiled(edit);
  Image edited = before;
  for (size_t p = 0; p < edited.NumPixels(); ++p) {
    Eigen::Map<Eigen::Vector3f> color(&edited.data[3 * p]);
    color = compiled.Apply(color.eval());
  }
  return edited;
}

SizeCheck SizeOf(const Mask& truth, const std::filesystem::path& path) {
  return [&](int width, int height) {
    if (width == truth.width && height == truth.height) return;
    throw InputError(path, "is not of the size of its true mask");
  };
}

Image ReadPicture(const std::filesystem::path& folder, const std::string& view, const Mask& truth) {
  const std::filesystem::path path = ViewFile(folder, view);
  return ReadImage(path, SizeOf(truth, path));
}

ViewScore ScoreOne(const ScoreRequest& request, const ScoredFile& file) {
  ViewScore score;
  score.scene = file.scene;
  score.view = file.view;
  score.painted = file.painted;
  const Mask truth = ReadTruth(file.truth);
  if (!request.after.empty()) {
    const Image before = ReadPicture(request.before, file.view, truth);
    const Image after = ReadPicture(request.after, file.view, truth);
    score.edit = ScoreEdit(before, Edited(before, request.edit), after, truth, request.border);
  }
  if (request.masks.empty()) return score;
  const bool is_view = request.layout == TruthLayout::kViews;
  const Mask mask = ReadMask(file.mask, is_view ? SizeOf(truth, file.mask) : SizeCheck());
  score.mask = ScoreMask(ResizedTo(mask, truth.width, truth.height), truth);
  return score;
}

// Degrees between the directions in which two cameras look.
double AngleBetween(const View& a, const View& b) {
  const auto axis = [](const View& view) {
    return (view.cam_from_world.Inverse().rotation * Eigen::Vector3d::UnitZ()).eval();
  };
  return std::acos(std::clamp(axis(a).dot(axis(b)), -1.0, 1.0)) * 180 / std::numbers::pi;
}

void FindDegrees(const ScoreRequest& request, std::vector<ViewScore>* scores) {
  if (!request.model || request.painted.empty()) return;
  std::vector<const View*> painted;
  for (const std::string& name : request.painted) {
    painted.push_back(request.model->FindView(name));
    if (!painted.back()) throw InputError("the workspace has no view " + name);
  }
  for (ViewScore& score : *scores) {
    const View* const view = request.model->FindView(score.view);
    if (!view) continue;
    for (const View* const other : painted) {
      const double degrees = AngleBetween(*view, *other);
      score.degrees = std::min(score.degrees.value_or(degrees), degrees);
    }
  }
}

// Warns of a painted view that has no true mask. InputError where nothing at all is of that view.
void CheckPainted(const ScoreRequest& request, const std::vector<ScoredFile>& files,
                  std::vector<std::string>* warnings) {
  if (request.model) return;  // FindDegrees() checks the names
  for (const std::string& name : request.painted) {
    if (std::any_of(files.begin(), files.end(),
                    [&](const ScoredFile& file) { return file.view == name; })) {
      continue;
    }
    const std::filesystem::path* const folders[] = {&request.truth, &request.masks, &request.before,
                                                    &request.after};
    const bool known = std::any_of(std::begin(folders), std::end(folders), [&](const auto* folder) {
      return !folder->empty() && std::filesystem::exists(ViewFile(*folder, name));
    });
    if (!known) throw InputError("no folder has a picture of the painted view " + name);
    warnings->push_back("no true mask is that of the painted view " + name);
  }
}

}  // namespace

ScoreReport Score(const ScoreRequest& request, Monitor& monitor) {
  CheckOption(request.before.empty() == request.after.empty(),
              "pictures are scored in pairs, before and after the edit");
  CheckOption(!request.masks.empty() || !request.after.empty(),
              "there is nothing to score: no masks and no pictures");
  CheckOption(request.after.empty() || request.layout == TruthLayout::kViews,
              "pictures are scored in the layout of views only");
  if (!request.after.empty()) CompiledEdit(request.edit);  // its faults before those of files
  ScoreReport report;
  const std::vector<ScoredFile> files = FindScoredFiles(request, &report.warnings);
  CheckPainted(request, files, &report.warnings);
  report.views.resize(files.size());
  // A few at a time, so that not all pictures are in memory at once.
  constexpr size_t kTogether = 8;
  for (size_t begin = 0; begin < files.size(); begin += kTogether) {
    monitor.Step("score", double(begin), double(files.size()));
    const size_t count = std::min(kTogether, files.size() - begin);
    ParallelTasks(int64_t(count), [&](int64_t i) {
      report.views[begin + size_t(i)] = ScoreOne(request, files[begin + size_t(i)]);
    });
  }
  monitor.Step("score", 1, 1);
  FindDegrees(request, &report.views);
  report.groups = GroupScores(request, report.views);
  return report;
}

}  // namespace retint
