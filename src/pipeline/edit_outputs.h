// SPDX-License-Identifier: BSD-3-Clause
// Files of a run for people: pictures of the edit, and the results of every stage.
#pragma once

#include <filesystem>
#include <map>

#include "base/monitor.h"
#include "editing/edit_session.h"

namespace retint {

// depth.bin, depth.png, cloud_raw.ply, cloud.ply, registration.json, paint/ and masks/ of a region
// in `folder`; depths of further painted views as depth/<picture name>.bin and .png. `selected`: of
// its painted views; masks from files have none.
void WriteStages(const std::filesystem::path& folder, EditSession& session, RegionId id,
                 const SelectionResult& selected, Monitor& monitor);
// targets/ and result/: the target of the fit in each picture, and its result.
void WriteTargets(const std::filesystem::path& folder, EditSession& session, TargetKind target,
                  Monitor& monitor);

// Before, mask and after of up to four views, a row each: painted ones, and others spread over
// those that the regions reach.
Image8 ComparisonPicture(EditSession& session, Monitor& monitor);

// A picture's depth of its views'. A view that has none counts as unknown.
DepthEstimate ComposeDepths(const Pictures& pictures, const UserPicture& picture,
                            const std::map<const View*, DepthEstimate>& depths);

// The depth map as COLMAP writes it, and its picture beside it. An empty path: not written.
void WriteDepth(const std::filesystem::path& map, const std::filesystem::path& picture,
                const DepthEstimate& depth);

}  // namespace retint
