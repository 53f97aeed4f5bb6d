// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/export.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <system_error>

#include "base/error.h"
#include "base/files.h"
#include "base/input_guard.h"
#include "base/option_name.h"
#include "base/ranks.h"
#include "base/run_clock.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "colmap_io/sparse.h"
#include "colmap_io/workspace.h"
#include "reporting/report_html.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

using Picture = std::function<Image(size_t)>;
using Name = std::function<fs::path(const fs::path& folder, size_t)>;

void ExportPictures(size_t count, const fs::path& folder, const Name& name, const Picture& picture,
                    Monitor& monitor) {
  CheckOutput(folder, /*as_folder=*/true);
  StagedOutput output;
  output.AddFolder(folder, [&](const fs::path& staged) {
    const auto make = [&](size_t i) -> std::function<void()> {
      return [path = name(staged, i), image = picture(i)] { WritePng(path, image); };
    };
    WriteOnAllCores(count, make, monitor);
  });
  output.Commit();
  monitor.Step("save", 1, 1);
}

// Of `replaced`, those that were not written anew.
void RemoveOthers(const std::vector<fs::path>& replaced, const std::set<fs::path>& written) {
  for (const fs::path& path : replaced) {
    std::error_code ignored;
    if (!written.contains(path)) fs::remove(path, ignored);
  }
}

// Of four values in a row, at t in [0, 1] between the second and the third.
template <typename Vector>
Vector CatmullRom(const Vector& a, const Vector& b, const Vector& c, const Vector& d, double t) {
  return 0.5 * (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) +
                t * t * t * (3 * b - a - 3 * c + d));
}

// As PlaceViews() names them: view_001.png.
bool IsPlacedName(const std::string& name) {
  static const std::regex pattern("view_[0-9]{3,}\\.png");
  return std::regex_match(name, pattern);
}

std::vector<fs::path> PicturesIn(const fs::path& folder) {
  static const std::set<std::string> extensions = {".png", ".jpg", ".jpeg", ".tif", ".tiff"};
  std::vector<fs::path> pictures;
  for (const fs::path& path : ListFolder(folder)) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extensions.contains(extension)) pictures.push_back(path);
  }
  return pictures;
}

// The names of the views of a model that ExportCameras() wrote; nullopt of another one.
std::optional<std::vector<std::string>> NamesOfExport(const fs::path& model) {
  static const std::set<std::string> parts = {"cameras.bin", "images.bin", "points3D.bin"};
  for (const fs::path& path : ListFolder(model)) {
    if (!parts.contains(path.filename().string())) return std::nullopt;
  }
  try {
    std::vector<std::string> names;
    const Reconstruction reconstruction = ReadReconstruction(model);
    for (const View* view : reconstruction.ViewsByName()) {
      if (!IsPlacedName(view->name)) return std::nullopt;
      names.push_back(view->name);
    }
    return names;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

double Mebibytes(size_t bytes) { return static_cast<double>(bytes) / (1024.0 * 1024.0); }

}  // namespace

void ExportViews(EditSession& session, const std::vector<const View*>& views,
                 std::span<const float> sh, const fs::path& folder, Monitor& monitor) {
  CheckOption(!views.empty(), "no view to export");
  session.scene().renderer().SetSh(sh);
  const Pictures pictures = session.scene().pictures();
  const auto shown = pictures.Showing(views);
  ExportPictures(
      shown.size(), folder,
      [&](const fs::path& staged, size_t i) { return ViewFile(staged, shown[i]->name); },
      [&](size_t i) {
        return pictures.Compose(*shown[i], [&](const View& view) {
          return std::move(
              session.scene().renderer().Render(session.scene().reconstruction().Posed(view)).rgb);
        });
      },
      monitor);
}

void ExportFrames(EditSession& session, const std::vector<PosedCamera>& path,
                  std::span<const float> sh, const fs::path& folder, Monitor& monitor,
                  const std::vector<fs::path>& replaced) {
  CheckOption(!path.empty(), "no frame to export");
  for (const fs::path& frame : replaced) InputGuard::Check(frame);
  session.scene().renderer().SetSh(sh);
  RenderRequest request;
  request.cache = false;  // seen once
  const int digits = std::max<int>(4, static_cast<int>(std::to_string(path.size() - 1).size()));
  const auto file = [digits](const fs::path& in, size_t i) {
    const std::string number = std::to_string(i);
    return in / (std::string(static_cast<size_t>(digits) - number.size(), '0') + number + ".png");
  };
  ExportPictures(
      path.size(), folder, file,
      [&](size_t i) { return std::move(session.scene().renderer().Render(path[i], request).rgb); },
      monitor);
  std::set<fs::path> written;
  for (size_t i = 0; i < path.size(); ++i) written.insert(file(folder, i));
  RemoveOthers(replaced, written);
}

std::vector<fs::path> CheckCamerasFolder(const fs::path& folder, bool overwrite) {
  const std::vector<fs::path> models = FindModels(folder);
  std::vector<fs::path> pictures = PicturesIn(folder);
  for (fs::path& path : PicturesIn(folder / "images")) pictures.push_back(std::move(path));
  if (models.empty() && pictures.empty()) return {};
  const std::string there = folder.string() + ": ";
  if (!overwrite) {
    const std::string what = models.empty() ? "pictures" : "a model";
    throw OptionError(there + "holds " + what +
                      " already: name another folder, or overwrite what retint cameras wrote there "
                      "(" +
                      OptionName("overwrite") + ")");
  }
  std::set<fs::path> own;
  for (const fs::path& model : models) {
    const auto names = NamesOfExport(model);
    if (model != folder / "sparse" / "0" || !names) {
      throw OptionError(there + "holds a model that retint cameras did not write, in " +
                        model.string() + ": name another folder");
    }
    for (const std::string& name : *names) own.insert(folder / "images" / name);
  }
  std::vector<fs::path> replaced;
  for (const fs::path& path : pictures) {
    if (own.contains(path)) {
      replaced.push_back(path);
    } else if (IsPlacedName(path.stem().string() + ".png")) {
      throw OptionError(there + path.lexically_relative(folder).string() +
                        " would count as a photo of a new view: name another folder");
    }
  }
  return replaced;
}

void ExportCameras(EditSession& session, bool images, const fs::path& folder, Monitor& monitor,
                   const std::vector<fs::path>& replaced) {
  CheckOutput(folder, /*as_folder=*/true);
  const Reconstruction& model = session.scene().reconstruction();
  const std::vector<const View*> views = model.ViewsByName();
  InputGuard own;  // CheckCamerasFolder() has read the model there, which is an earlier export
  for (const char* part : {"cameras.bin", "images.bin", "points3D.bin"}) {
    own.Allow(folder / "sparse" / "0" / part);
  }
  StagedOutput output;
  output.AddFolder(folder, [&](const fs::path& staged) {
    WriteReconstructionBinary(staged / "sparse" / "0", model);
    for (size_t i = 0; images && i < views.size(); ++i) {
      monitor.Step("render", static_cast<double>(i), static_cast<double>(views.size()));
      WritePng(ViewFile(staged / "images", views[i]->name, ""),
               session.scene().Render(*views[i], session.scene().original().sh));
    }
  });
  monitor.Step("render", 1, 1);
  output.Commit();
  std::set<fs::path> written;
  for (const View* view : views) {
    if (images) written.insert(ViewFile(folder / "images", view->name, ""));
  }
  RemoveOthers(replaced, written);
}

std::vector<PosedCamera> OrbitPath(const PosedCamera& start, const Eigen::Vector3d& focus,
                                   const Eigen::Vector3d& up, int frames) {
  CheckOption(frames >= 1, "a turn has at least one frame");
  CheckOption(up.norm() > 0, "the axis of a turn has no direction");
  std::vector<PosedCamera> path(static_cast<size_t>(frames), start);
  const Eigen::Vector3d axis = up.normalized();
  for (int i = 0; i < frames; ++i) {
    const double angle = 2 * std::numbers::pi * i / frames;
    // The camera turns with the world held still: world points turn back before it sees them.
    const Eigen::Quaterniond back(Eigen::AngleAxisd(-angle, axis));
    Rigid3d& pose = path[static_cast<size_t>(i)].cam_from_world;
    pose.rotation = (start.cam_from_world.rotation * back).normalized();
    pose.translation =
        start.cam_from_world.rotation * (focus - back * focus) + start.cam_from_world.translation;
  }
  return path;
}

std::vector<PosedCamera> ViewPath(const Reconstruction& reconstruction,
                                  const std::vector<const View*>& views, int frames) {
  CheckOption(frames >= 1, "a path has at least one frame");
  CheckOption(!views.empty(), "a path needs a view");
  std::vector<Eigen::Vector3d> centers;
  std::vector<Eigen::Vector4d> rotations;  // x, y, z, w; neighbors on the same side
  for (const View* view : views) {
    centers.push_back(view->cam_from_world.OriginInSource());
    Eigen::Vector4d q = view->cam_from_world.rotation.coeffs();
    if (!rotations.empty() && q.dot(rotations.back()) < 0) q = -q;
    rotations.push_back(q);
  }
  const auto last = static_cast<int>(views.size()) - 1;
  std::vector<PosedCamera> path(static_cast<size_t>(frames), reconstruction.Posed(*views[0]));
  for (int i = 0; i < frames; ++i) {
    const double at = frames > 1 ? static_cast<double>(i) * last / (frames - 1) : 0;
    const int from = std::min(static_cast<int>(at), std::max(0, last - 1));
    const auto index = [&](int by) { return static_cast<size_t>(std::clamp(from + by, 0, last)); };
    const double t = at - from;
    Rigid3d& pose = path[static_cast<size_t>(i)].cam_from_world;
    const Eigen::Vector3d center =
        CatmullRom(centers[index(-1)], centers[index(0)], centers[index(1)], centers[index(2)], t);
    const Eigen::Vector4d q = CatmullRom(rotations[index(-1)], rotations[index(0)],
                                         rotations[index(1)], rotations[index(2)], t);
    pose.rotation = Eigen::Quaterniond(q).normalized();
    pose.translation = -(pose.rotation * center);
  }
  return path;
}

QualityReport EvaluateRegion(EditSession& session, RegionId id, TargetKind target, Monitor& monitor,
                             size_t most_views, int row_step) {
  RegionSet regions = session.store().regions();
  Region* region = regions.Find(id);
  if (!region) throw OptionError("there is no region " + std::to_string(id));
  region->visible = true;
  const auto index = static_cast<size_t>(region - regions.regions.data());
  const GaussianModel& original = session.scene().original();
  const RefitJob& job = session.store().job();
  Backend& backend = session.scene().renderer().backend();
  const FloatArray before = ComposeSh(backend, regions, job, 0, index, original.sh, original);
  const FloatArray after = ComposeSh(backend, regions, job, index, index + 1, before, original);
  return session.refits().Evaluate(id, before, after, target, monitor, most_views, row_step);
}

Coverage MeasureCoverage(const std::map<std::string, Mask>& masks, size_t views) {
  Coverage coverage;
  for (const auto& [name, mask] : masks) {
    const double inside = FractionInside(mask);
    coverage.views += inside > 0 ? 1 : 0;
    coverage.mean += inside;
  }
  if (views > 0) coverage.mean /= static_cast<double>(views);
  return coverage;
}

RunReport MakeReport(const EditSession& session) {
  const OpenScene& scene = session.scene();
  const Ranks& ranks = CurrentRanks();
  RunReport report;
  report.backend = scene.backend().Name();
  report.ranks = ranks.size();
  report.sent_mb = Mebibytes(ranks.bytes_sent());
  report.exchange = ranks.exchange();
  report.gaussians = static_cast<int64_t>(scene.NumGaussians());
  report.views = static_cast<int>(scene.reconstruction().views.size());
  for (const char* stage :
       {"load", "depth", "cloud", "registration", "projection", "refine", "refit", "save"}) {
    report.stages_ms[stage] = scene.clock().Get(stage);
  }
  report.stages_ms["total"] = scene.clock().Total();
  report.peak_rss_mb = PeakRssMb();
  report.peak_device_mb = Mebibytes(scene.backend().PeakDeviceBytes());
  report.refit = session.refits().Summary();
  const RegionSet& set = session.store().regions();
  if (set.regions.size() == 1) report.edit = set.regions.front().EffectiveEdit();
  return report;
}

RunReport FullReport(EditSession& session, TargetKind target, Monitor& monitor, size_t most_views,
                     int row_step) {
  RunReport report = MakeReport(session);
  const RegionSet regions = session.store().regions();
  const size_t num_views = session.scene().reconstruction().views.size();
  std::set<std::string> views;  // that hold a selected pixel
  double coverage = 0;
  int visible = 0;
  for (const Region& region : regions.regions) {
    for (const PaintedReport& painted : region.selection->source.reports) {
      report.painted.push_back(painted);
    }
    if (!region.visible) continue;
    RegionReport one;
    one.name = region.name;
    one.edit = region.EffectiveEdit();
    one.quality = EvaluateRegion(session, region.id, target, monitor, most_views, row_step);
    if (visible++ == 0) report.quality = one.quality;
    report.regions.push_back(std::move(one));
    for (const auto& [name, mask] : region.selection->masks) {
      if (AnyInside(mask)) views.insert(name);
    }
    coverage += MeasureCoverage(region.selection->masks, num_views).mean;
  }
  if (visible > 1) {
    QualityReport none;
    none.sh_before = report.regions.front().quality.sh_before;
    none.sh_after = report.regions.back().quality.sh_after;
    report.quality = none;
  }
  report.mask_views = static_cast<int>(views.size());
  report.mean_coverage = visible > 0 ? coverage / visible : 0;
  return report;
}

void ExportReport(EditSession& session, RefitJob job, const fs::path& path, Monitor& monitor) {
  CheckOutput(path);
  RunReport report = FullReport(session, job.target, monitor);
  report.options = SettingsThatApply(Described(job));
  if (path.extension() != ".html" && path.extension() != ".htm") {
    return WriteFile(path, ToJson(report));
  }
  HtmlReportOptions options;
  options.title = "Recoloring of " + session.scene().splat_path().filename().string();
  WriteFile(path, HtmlReport(session, report, options, monitor));
}

}  // namespace retint
