// SPDX-License-Identifier: BSD-3-Clause
// The tiny cloud as files, and a session on it with everything that a session can hold.
#pragma once

#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "colmap_io/sparse.h"
#include "saving/session_file.h"
#include "splat_io/splat_io.h"
#include "tests/editing/session_scene.h"
#include "tests/support/data.h"

namespace retint {

inline bool SameBits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// folder/ws and folder/ws/splat.ply.
inline void WriteTinyScene(const TinyScene& scene, const std::filesystem::path& folder) {
  WriteReconstructionBinary(folder / "ws" / "sparse" / "0", MakeWorkspace(scene).reconstruction);
  WriteSplat(folder / "ws" / "splat.ply", scene.model);
}

inline std::unique_ptr<EditSession> OpenTinyScene(const std::filesystem::path& folder) {
  SessionOptions options;
  options.backend = "cpu";
  Monitor monitor;
  return EditSession::Open(folder / "ws", folder / "ws" / "splat.ply", options, monitor);
}

inline SelectionSource TinySource(const TinyScene& scene) {
  SelectionSource source;
  source.painted.push_back({ViewName(0), scene.cameras[0], scene.masks[0]});
  source.painted.back().outlined_by = "a network\xff.onnx";  // a file's name may be no UTF-8
  PosedCamera free = LookAtOrigin(0.123456789, 3.7, 32, 20);
  free.camera.params[0] = 71.0 / 3.0;
  Mask mask(32, 20);
  for (size_t i = 0; i < mask.data.size(); ++i) mask.data[i] = static_cast<uint8_t>(i * 37);
  source.painted.push_back({"free view 1", free, mask});
  source.select.depth_method = "gaussian";
  source.projector.completion = Completion::kAll;
  source.cloud.sources = {ViewName(0), "free view 1"};
  for (int i = 0; i < 50; ++i) {
    SelectionPoint point;
    point.position = Eigen::Vector3f(0.1F, 0.7F, 1.0F / 3.0F) * static_cast<float>(i);
    point.normal = Eigen::Vector3f(0, 0, -1);
    point.footprint = 0.01F / 7.0F;
    point.confidence = i % 2 == 0 ? 1.0F : 0.5F;
    point.coverage = 0.3F;
    point.color = {1, 2, static_cast<uint8_t>(i)};
    point.source = static_cast<uint16_t>(i % 2);
    point.x = static_cast<uint16_t>(i);
    point.y = 7;
    source.cloud.points.push_back(point);
  }
  PaintedReport report;
  report.view = ViewName(0);
  report.outlined_by = "a network\xff.onnx";
  report.depth_method = "stereo-hv";
  report.valid_fraction = 1.0 / 3.0;
  report.registration.points_used = 40;
  report.registration.rms_after = 0.1 / 3.0;
  report.registration.world_from_cloud.scale = 1.0 + 1.0 / 3.0;
  source.reports.push_back(report);
  return source;
}

// Two regions, of which the second's fit is out of date; names that need care.
inline void EditTinyScene(const TinyScene& scene, EditSession& session) {
  Monitor monitor;
  session.store().Add("left \"100 %\" é", MasksOf(scene), scene.shares,
                      ColorEdit::Tint({0.2F, 0.4F, 1.0F}), monitor, TinySource(scene));
  std::vector<float> other;
  for (const float share : scene.shares) other.push_back((1 - share) / 3.0F);
  const RegionId right = session.store().Add("right", OtherMasksOf(scene), other,
                                             ColorEdit::Tint({1.0F, 0.1F, 0.1F}), monitor);
  RefitJob job;
  job.options.mm.iterations = 3;
  job.options.mm.ridge_dc = 0.1 / 3.0;
  session.refits().Refit(job, monitor);
  session.store().Do(SetEdit{right, ColorEdit::Tint({1.0F, 0.3F, 0.1F}), 1.0F / 3.0F});
}

}  // namespace retint
