// SPDX-License-Identifier: BSD-3-Clause
// The edited photos, for programs that work on photos: texturing, photogrammetry, training anew.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "base/staged_output.h"
#include "colmap_io/mask_names.h"
#include "editing/edit_session.h"

namespace retint {

struct PhotoExport {
  int edited = 0, unchanged = 0;
  std::vector<std::string> warnings;  // of photos that are missing or lose their metadata
};

// In `folder`, images/ with every photo of the model under its name (EditedPhoto(), PhotoFile), and
// masks/ with the visible regions together, of the size of the photo's camera. A photo that no edit
// changes is a hard link to the original or, on another file system, a copy. InputError when no
// photo is there, OptionError as WriteMasks(), RunError when one cannot be written. Stage: "save".
PhotoExport ExportPhotos(EditSession& session, const std::filesystem::path& folder, MaskNames names,
                         Monitor& monitor);
// The same, staged for `folder`, if that is not empty. `warn`, if it is there, is called with each
// warning.
PhotoExport StagePhotos(StagedOutput& staged, EditSession& session,
                        const std::filesystem::path& folder, MaskNames names,
                        const std::function<void(const std::string&)>& warn, Monitor& monitor);

// The files that it would write, for checks before the work; none in an empty folder.
std::vector<std::filesystem::path> PhotoExportFiles(const Workspace& workspace,
                                                    const std::filesystem::path& folder,
                                                    MaskNames names);

}  // namespace retint
