// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: one file of a sparse model to and from bytes. The readers add to `model`,
// and throw InputError with `path` and the offset or line. Bad records are left out with a warning
// if others remain. References are checked in sparse.cc.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "scene/reconstruction.h"

namespace retint::sparse_codec {

using Path = std::filesystem::path;
using Warnings = std::vector<std::string>;

// A record that is whole, of which a value cannot be: others of its file may be sound.
class BadRecord : public InputError {
 public:
  using InputError::InputError;
};

// The bad records of a file, which is read without them.
class LeftOut {
 public:
  void Add(std::string fault) { faults_.push_back(std::move(fault)); }
  // Calls `read`; false where it threw a BadRecord, which is added.
  template <typename Read>
  bool IsSound(const Read& read) {
    try {
      read();
      return true;
    } catch (const BadRecord& fault) {
      Add(fault.what());
      return false;
    }
  }
  // Warns of the first few; if no record is `left`, throws the first.
  void Tell(const Path& path, size_t left, Warnings& warnings) const;

 private:
  std::vector<std::string> faults_;
};

// The faults of bad cameras, which are left out. The others are enough only if no view has a bad
// one.
using BadCameras = std::map<CameraId, std::string>;

BadCameras ReadCamerasBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                             Reconstruction& model);
void ReadImagesBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                      Reconstruction& model);
void ReadPointsBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                      Reconstruction& model);
// Views of the files `rigs` and `frames`, each binary or text by its extension. They have poses but
// no names nor observations: the views are named "image_00042" by their ids.
void ReadRigsAndFrames(const Path& rigs, const Path& frames, Warnings& warnings,
                       Reconstruction& model);
BadCameras ReadCamerasText(std::string_view bytes, const Path& path, Warnings& warnings,
                           Reconstruction& model);
void ReadImagesText(std::string_view bytes, const Path& path, Warnings& warnings,
                    Reconstruction& model);
void ReadPointsText(std::string_view bytes, const Path& path, Warnings& warnings,
                    Reconstruction& model);

std::string CamerasToBinary(const Reconstruction& model);
std::string ImagesToBinary(const Reconstruction& model);
std::string PointsToBinary(const Reconstruction& model);
std::string CamerasToText(const Reconstruction& model);
std::string ImagesToText(const Reconstruction& model);
std::string PointsToText(const Reconstruction& model);

// The fault of a camera's size or parameters, beyond the checks of the formats themselves; empty if
// there is none.
std::string CameraFault(const Camera& camera, uint64_t width, uint64_t height);
// Normalizes where needed (see ReadReconstruction); false when the quaternion has no direction.
bool NormalizeRotation(Eigen::Quaterniond& rotation);

}  // namespace retint::sparse_codec
