// SPDX-License-Identifier: BSD-3-Clause
// session.json to and from values. Reading throws InputError with the file and
// the key at fault.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/checksum.h"
#include "base/json_node.h"
#include "saving/session_file.h"

namespace retint::session_json {

using json::Json;
using json::Node;

inline constexpr const char* kManifest = "session.json";
inline constexpr const char* kFormat = "retint-session";

// The file, parsed; its format and version checked.
Json ReadManifest(const std::filesystem::path& folder);

Json JobJson(const RefitJob& job);
RefitJob ReadJob(const Node& node);
Json EditJson(const Region& region);  // id, name, visible, strength, edit
void ReadEdit(const Node& node, Region* region);
// Of placed views, the files of the COLMAP model that they are stored as.
inline constexpr const char* kViewFiles[] = {"cameras.bin", "images.bin", "points3D.bin"};
// [scale, qw, qx, qy, qz, tx, ty, tz], null for the identity.
Json SimilarityJson(const Sim3d& similarity);
Sim3d ReadSimilarity(const Node& node);
Json CameraJson(const PosedCamera& view);
PosedCamera ReadCamera(const Node& node);  // 1 to 65535 pixels a side; of any model
// The options with which a selection was made. Sessions that have none get the defaults.
Json SelectionJson(SelectOptions select, ProjectorOptions projector);
void ReadSelection(const Node& node, SelectOptions* select, ProjectorOptions* projector);
Json ReportJson(const PaintedReport& report);
PaintedReport ReadReport(const Node& node);
Json SummaryJson(const RefitSummary& summary);
RefitSummary ReadSummary(const Node& node);

// A path as {"relative": to `folder`'s parent, "absolute"}; moves with the session, and is found
// where only the session moved.
Json PathJson(const std::filesystem::path& path, const std::filesystem::path& folder);
// Its possible places, the likeliest first.
std::vector<std::filesystem::path> ReadPaths(const Node& node, const std::filesystem::path& folder);

}  // namespace retint::session_json
