// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/export_photos.h"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "colmap_io/photo_file.h"
#include "editing/edited_photo.h"
#include "selecting/selection_files.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// With the extension that the photo's file has, which the model's name may lack.
fs::path PhotoOutput(const Workspace& workspace, const fs::path& folder,
                     const UserPicture& picture) {
  const fs::path photo = workspace.PhotoPath(*picture.faces.front());
  return ViewFile(folder, fs::path(picture.name).replace_extension(photo.extension()).string(), "");
}

void LinkOrCopy(const fs::path& photo, const fs::path& to) {
  std::error_code code;
  fs::create_directories(to.parent_path(), code);
  fs::create_hard_link(fs::canonical(photo), to, code);
  if (!code) return;
  fs::copy_file(photo, to, code);
  if (code) throw RunError(to.string() + ": cannot write: " + code.message());
}

// Of all visible regions, each pixel's largest.
std::map<std::string, Mask> UnionOfRegions(const RegionSet& regions, const Pictures& pictures) {
  std::map<std::string, Mask> all;
  for (const Region& region : regions.regions) {
    if (!region.visible) continue;
    for (auto& [name, mask] : pictures.FromViews(region.selection->masks)) {
      Mask& sum = all.try_emplace(name, mask.width, mask.height).first->second;
      std::ranges::transform(sum.data, mask.data, sum.data.begin(),
                             [](uint8_t a, uint8_t b) { return std::max(a, b); });
    }
  }
  return all;
}

struct Written {
  bool edited = false, loses_metadata = false;
};

}  // namespace

PhotoExport ExportPhotos(EditSession& session, const fs::path& folder, MaskNames names,
                         Monitor& monitor) {
  OpenScene& scene = session.scene();
  const Workspace& workspace = scene.workspace();
  const RegionSet& regions = session.store().regions();
  const Pictures pictures(workspace, Pixels::kPhoto);
  WriteMasks(folder / "masks", UnionOfRegions(regions, pictures), monitor, names);
  PhotoExport result;
  std::vector<const UserPicture*> there;
  std::vector<fs::path> missing;
  for (const UserPicture& picture : pictures.all()) {
    const View& view = *picture.faces.front();
    if (workspace.HasPhoto(view)) {
      there.push_back(&picture);
    } else {
      missing.push_back(fs::absolute(workspace.PhotoPath(view)).lexically_normal());
    }
  }
  if (there.empty()) throw InputError(missing.front(), "no such photo, nor any other of the model");
  if (!missing.empty()) {
    result.warnings.push_back(std::to_string(missing.size()) +
                              " photos are missing and not written, such as " +
                              missing.front().string());
  }
  scene.renderer().SetSh(scene.original().sh);
  std::vector<Written> written(there.size());
  const auto make = [&](size_t i) -> std::function<void()> {
    const UserPicture& picture = *there[i];
    const fs::path photo = workspace.PhotoPath(*picture.faces.front());
    const fs::path to = PhotoOutput(workspace, folder / "images", picture);
    if (!IsEdited(regions, picture)) return [photo, to] { LinkOrCopy(photo, to); };
    const auto file = std::make_shared<const PhotoFile>(photo, picture.width, picture.height);
    auto edited =
        std::make_shared<const Image>(EditedPhoto(scene, regions, picture, file->Shown()));
    return [photo, to, file, edited, &is = written[i]] {
      const std::optional<std::string> bytes = file->With(*edited);
      if (!bytes) return LinkOrCopy(photo, to);
      is = {true, !file->KeepsMetadata()};
      WriteFile(to, *bytes);
    };
  };
  size_t most_pixels = 0;
  for (const UserPicture* picture : there) {
    most_pixels = std::max(most_pixels, size_t(picture->width) * size_t(picture->height));
  }
  // The file, its pixels and the edited ones.
  WriteOnAllCores(there.size(), make, monitor, most_pixels * (sizeof(float) * 3 * 2 + 6));
  for (const Written& one : written) ++(one.edited ? result.edited : result.unchanged);
  const auto lost = std::ranges::count_if(written, &Written::loses_metadata);
  if (lost > 0) {
    result.warnings.push_back("the metadata of " + std::to_string(lost) +
                              " photos is lost: only JPEG and PNG keep it");
  }
  return result;
}

PhotoExport StagePhotos(StagedOutput& staged, EditSession& session, const fs::path& folder,
                        MaskNames names, const std::function<void(const std::string&)>& warn,
                        Monitor& monitor) {
  PhotoExport result;
  if (folder.empty()) return result;
  staged.AddFolder(folder,
                   [&](const fs::path& to) { result = ExportPhotos(session, to, names, monitor); });
  for (const std::string& warning : result.warnings) {
    if (warn) warn(folder.string() + ": " + warning);
  }
  return result;
}

std::vector<fs::path> PhotoExportFiles(const Workspace& workspace, const fs::path& folder,
                                       MaskNames names) {
  std::vector<fs::path> files;
  if (folder.empty()) return files;
  const Pictures pictures(workspace, Pixels::kPhoto);
  for (const UserPicture& picture : pictures.all()) {
    files.push_back(PhotoOutput(workspace, folder / "images", picture));
    files.push_back(MaskFile(folder / "masks", picture.name, names));
  }
  return files;
}

}  // namespace retint
