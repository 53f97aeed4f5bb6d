// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/sparse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <set>

#include "base/files.h"
#include "colmap_io/sparse_codec.h"
#include "scene/image_size.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr std::array kParts = {"cameras", "images", "points3D"};
constexpr size_t kNamesInWarning = 3;

std::string Count(size_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

void DropViewsWithoutCamera(const fs::path& folder, Reconstruction& model,
                            std::vector<std::string>& warnings) {
  std::string names;
  size_t dropped = 0;
  for (auto it = model.views.begin(); it != model.views.end();) {
    if (model.cameras.count(it->second.camera_id) > 0) {
      ++it;
      continue;
    }
    if (dropped < kNamesInWarning) names += (dropped ? ", " : "") + it->second.name;
    ++dropped;
    it = model.views.erase(it);
  }
  if (dropped == 0) return;
  warnings.push_back(folder.string() + ": left out " + Count(dropped, "view") +
                     " whose camera is missing: " + names +
                     (dropped > kNamesInWarning ? ", ..." : ""));
}

// InputError for a bad camera that a view has.
void TellOfCameras(const sparse_codec::BadCameras& bad, const fs::path& cameras,
                   const Reconstruction& model, std::vector<std::string>& warnings) {
  for (const auto& [id, view] : model.views) {
    const auto found = bad.find(view.camera_id);
    if (found != bad.end()) throw InputError(found->second);
  }
  sparse_codec::LeftOut left_out;
  for (const auto& [id, fault] : bad) left_out.Add(fault);
  left_out.Tell(cameras, model.cameras.size(), warnings);
}

void CheckNames(const fs::path& images, const Reconstruction& model) {
  std::set<std::string_view> names;
  for (const auto& [id, view] : model.views) {
    if (!names.insert(view.name).second) {
      throw InputError(images, "two images are named \"" + view.name + "\"");
    }
  }
}

void DropDanglingReferences(const fs::path& folder, Reconstruction& model,
                            std::vector<std::string>& warnings) {
  size_t track_elements = 0, observations = 0;
  for (auto& [id, point] : model.points) {
    const size_t before = point.track.size();
    std::erase_if(point.track, [&](const TrackElement& element) {
      const auto view = model.views.find(element.view_id);
      return view == model.views.end() ||
             element.observation_idx >= view->second.observations.size();
    });
    track_elements += before - point.track.size();
  }
  // A sorted array is searched several times faster than the map of points.
  std::vector<PointId> ids;
  ids.reserve(model.points.size());
  for (const auto& [id, point] : model.points) ids.push_back(id);
  for (auto& [id, view] : model.views) {
    for (Observation& observation : view.observations) {
      if (observation.point_id == kInvalidPointId ||
          std::binary_search(ids.begin(), ids.end(), observation.point_id)) {
        continue;
      }
      observation.point_id = kInvalidPointId;
      ++observations;
    }
  }
  if (track_elements > 0) {
    warnings.push_back(folder.string() + ": left out " + Count(track_elements, "track element") +
                       " that name a missing view or observation");
  }
  if (observations > 0) {
    warnings.push_back(folder.string() + ": " + Count(observations, "observation") +
                       " of missing points left without a point");
  }
}

using Encoder = std::string (*)(const Reconstruction&);

void Write(const fs::path& folder, const Reconstruction& model, const char* extension,
           const std::array<Encoder, 3>& encoders) {
  for (const char* part : {"rigs", "frames"}) {
    const fs::path stale = folder / (std::string(part) + extension);
    if (IsFile(stale)) {
      throw RunError(stale.string() + ": belongs to another model; write to an empty folder");
    }
  }
  std::array<std::unique_ptr<AtomicFile>, 3> files;
  for (size_t i = 0; i < files.size(); ++i) {
    files[i] = std::make_unique<AtomicFile>(folder / (std::string(kParts[i]) + extension));
    files[i]->Write(encoders[i](model));
  }
  for (const auto& file : files) file->Sync();
  for (const auto& file : files) file->Commit();
}

void CheckNamesStorable(const Reconstruction& model, std::string_view forbidden) {
  for (const auto& [id, view] : model.views) {
    if (view.name.empty() || view.name.find_first_of(forbidden) != std::string::npos) {
      throw InputError("image " + std::to_string(id) + ": its name cannot be stored: \"" +
                       view.name + "\"");
    }
  }
}

}  // namespace

namespace sparse_codec {

void LeftOut::Tell(const Path& path, size_t left, Warnings& warnings) const {
  if (faults_.empty()) return;
  if (left == 0) throw InputError(faults_.front());
  for (size_t i = 0; i < std::min(faults_.size(), kNamesInWarning); ++i) {
    warnings.push_back(faults_[i] + "; it is left out");
  }
  if (faults_.size() > kNamesInWarning) {
    warnings.push_back(path.string() + ": " +
                       Count(faults_.size() - kNamesInWarning, "more record") +
                       " left out for such faults");
  }
}

std::string CameraFault(const Camera& camera, uint64_t width, uint64_t height) {
  if (!IsImageSize(width, height)) {
    return "image size " + std::to_string(width) + "x" + std::to_string(height) +
           " is out of range";
  }
  if (camera.IsPinhole() && !(camera.fx() > 0 && camera.fy() > 0)) {
    return "focal length is not positive";
  }
  return "";
}

bool NormalizeRotation(Eigen::Quaterniond& rotation) {
  constexpr double kUnit = 1e-9;
  const double norm = rotation.norm();
  if (!(norm > 1e-6) || !std::isfinite(norm)) return false;
  if (std::abs(norm - 1) > kUnit) rotation.coeffs() /= norm;
  return true;
}

}  // namespace sparse_codec

bool HasReconstruction(const fs::path& folder) {
  for (const char* part : kParts) {
    for (const char* extension : {".bin", ".txt"}) {
      if (IsFile(folder / (std::string(part) + extension))) return true;
    }
  }
  return false;
}

Reconstruction ReadReconstruction(const fs::path& folder, std::vector<std::string>* warnings) {
  if (!IsFolder(folder)) throw InputError(folder, "is not a folder");
  if (!HasReconstruction(folder)) {
    throw InputError(folder, "holds no COLMAP model (cameras, images and points3D, .bin or .txt)");
  }
  // A part that is there as both is read as binary, which has every digit.
  const bool any_binary = IsFile(folder / "cameras.bin") || IsFile(folder / "images.bin");
  const auto part = [&](const std::string& name) {
    const fs::path binary = folder / (name + ".bin"), text = folder / (name + ".txt");
    return IsFile(binary) || (!IsFile(text) && any_binary) ? binary : text;
  };
  const auto is_binary = [](const fs::path& path) { return path.extension() == ".bin"; };

  using namespace sparse_codec;
  Reconstruction model;
  std::vector<std::string> told;
  const fs::path cameras = part("cameras"), images = part("images"), points = part("points3D");
  const fs::path rigs = part("rigs"), frames = part("frames");
  const bool by_frames = !IsFile(images) && IsFile(rigs) && IsFile(frames);
  for (const auto& path : {cameras, images}) {
    if (IsFile(path) || (path == images && by_frames)) continue;
    throw InputError(path, "is missing from the COLMAP model");
  }
  const BadCameras bad = (is_binary(cameras) ? ReadCamerasBinary : ReadCamerasText)(
      ReadFile(cameras), cameras, told, model);
  if (by_frames) {
    ReadRigsAndFrames(rigs, frames, told, model);
  } else {
    (is_binary(images) ? ReadImagesBinary : ReadImagesText)(ReadFile(images), images, told, model);
  }
  if (IsFile(points)) {
    (is_binary(points) ? ReadPointsBinary : ReadPointsText)(ReadFile(points), points, told, model);
  } else {
    told.push_back(points.string() + ": is missing; going on without sparse points");
  }
  CheckNames(images, model);
  TellOfCameras(bad, cameras, model, told);
  DropViewsWithoutCamera(folder, model, told);
  DropDanglingReferences(folder, model, told);
  if (warnings != nullptr) warnings->insert(warnings->end(), told.begin(), told.end());
  return model;
}

void WriteReconstructionBinary(const fs::path& folder, const Reconstruction& model) {
  using namespace sparse_codec;
  CheckNamesStorable(model, std::string_view("\0", 1));
  Write(folder, model, ".bin", {CamerasToBinary, ImagesToBinary, PointsToBinary});
}

void WriteReconstructionText(const fs::path& folder, const Reconstruction& model) {
  using namespace sparse_codec;
  CheckNamesStorable(model, std::string_view("\0\n\r", 3));
  Write(folder, model, ".txt", {CamerasToText, ImagesToText, PointsToText});
}

}  // namespace retint
