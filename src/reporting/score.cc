// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/score.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>

#include <Eigen/Core>

#include "base/error.h"
#include "base/files.h"
#include "base/parallel.h"
#include "colmap_io/image_io.h"
#include "colmap_io/mask_names.h"
#include "reporting/score_report.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// Views with a true mask, <view>.png below the folder, by name. Hidden files are left out.
std::vector<std::string> ViewsWithTruth(const fs::path& folder) {
  if (!IsFolder(folder)) throw InputError(folder, "no such folder");
  std::vector<std::string> views;
  std::error_code error;
  for (auto entry = fs::recursive_directory_iterator(folder, error);
       entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (error) break;
    if (entry->path().filename().string().starts_with('.')) {
      if (entry->is_directory()) entry.disable_recursion_pending();
    } else if (entry->path().extension() == ".png" && IsFile(entry->path())) {
      const std::string name = entry->path().lexically_relative(folder).generic_string();
      views.push_back(name.substr(0, name.size() - 4));
    }
  }
  if (error) throw InputError(folder, "cannot be read: " + error.message());
  if (views.empty()) throw InputError(folder, "holds no true mask that could be scored");
  std::sort(views.begin(), views.end());
  return views;
}

Mask ReadTruth(const fs::path& path) {
  Mask mask = ReadMask(path);
  const uint8_t largest = *std::max_element(mask.data.begin(), mask.data.end());
  if (!IsInside(largest)) {
    for (uint8_t& value : mask.data) value = value > 0 ? 255 : 0;
  }
  return mask;
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

SizeCheck SizeOf(const Mask& truth, const fs::path& path) {
  return [&](int width, int height) {
    if (width == truth.width && height == truth.height) return;
    throw InputError(path, "is not of the size of its true mask");
  };
}

Image ReadPicture(const fs::path& folder, const std::string& view, const Mask& truth) {
  const fs::path path = ViewFile(folder, view);
  return ReadImage(path, SizeOf(truth, path));
}

// The mask by any of its names; if there is no file, by the first.
fs::path MaskOf(const ScoreRequest& request, const std::string& view) {
  return FindMask(request.masks, view).value_or(ViewFile(request.masks, view));
}

// Fills `score`, which holds the view's name, from the files of that view.
void ScoreOne(const ScoreRequest& request, ViewScore* score) {
  const Mask truth = ReadTruth(ViewFile(request.truth, score->view));
  if (!request.after.empty()) {
    const Image before = ReadPicture(request.before, score->view, truth);
    const Image after = ReadPicture(request.after, score->view, truth);
    score->edit = ScoreEdit(before, Edited(before, request.edit), after, truth, request.border);
  }
  if (request.masks.empty()) return;
  const fs::path file = MaskOf(request, score->view);
  score->mask = ScoreMask(ReadMask(file, SizeOf(truth, file)), truth);
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

// Warns of a painted view that has no true mask. InputError if no folder has a file of that view.
void CheckPainted(const ScoreRequest& request, const std::vector<std::string>& views,
                  std::vector<std::string>* warnings) {
  if (request.model) return;  // FindDegrees() checks the names
  for (const std::string& name : request.painted) {
    if (std::find(views.begin(), views.end(), name) != views.end()) continue;
    const fs::path* const folders[] = {&request.truth, &request.masks, &request.before,
                                       &request.after};
    const bool known = std::any_of(std::begin(folders), std::end(folders), [&](const auto* folder) {
      return !folder->empty() && fs::exists(ViewFile(*folder, name));
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
  if (!request.after.empty()) CompiledEdit(request.edit);  // its faults before those of files
  ScoreReport report;
  const std::vector<std::string> views = ViewsWithTruth(request.truth);
  for (const std::string& view : views) {
    const fs::path mask = request.masks.empty() ? fs::path() : MaskOf(request, view);
    if (!mask.empty() && !IsFile(mask)) throw InputError(mask, "no such mask");
    ViewScore& score = report.views.emplace_back();
    score.view = view;
    score.painted =
        std::find(request.painted.begin(), request.painted.end(), view) != request.painted.end();
  }
  CheckPainted(request, views, &report.warnings);
  // A few at a time, so that not all pictures are in memory at once.
  constexpr size_t kTogether = 8;
  for (size_t begin = 0; begin < views.size(); begin += kTogether) {
    monitor.Step("score", double(begin), double(views.size()));
    const size_t count = std::min(kTogether, views.size() - begin);
    ParallelTasks(int64_t(count),
                  [&](int64_t i) { ScoreOne(request, &report.views[begin + size_t(i)]); });
  }
  monitor.Step("score", 1, 1);
  FindDegrees(request, &report.views);
  report.groups = GroupScores(request, report.views);
  return report;
}

}  // namespace retint
