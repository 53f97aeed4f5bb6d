// SPDX-License-Identifier: BSD-3-Clause
// Measures an open scene and writes its files. Each call queues a task of the controller. Written
// files have the colors of every region that is not hidden; SceneController::solo() does not
// matter.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <QObject>
#include <QString>

#include "editing/edit_session.h"
#include "recolor/quality_report.h"
#include "viewer/scene/lens_picture.h"

namespace retint {

class SceneController;

class SceneResults : public QObject {
  Q_OBJECT

 public:
  explicit SceneResults(SceneController* scene);

  void Evaluate(RegionId id);                       // qualityReady()
  quint64 measuring() const { return measuring_; }  // the task of the last Evaluate()
  // Identifies the edit of a region, to compare with the measured one; empty: no such region.
  std::string EditKey(RegionId id) const;
  // Evaluate() on a few views, quickly: qualityGlanced().
  void Glance(RegionId id);
  // Checks whether splat and workspace belong together: sceneChecked(). Renders a few small views.
  void Check();

  void WriteSplat(const std::filesystem::path& path);
  void WriteMasks(const std::filesystem::path& folder, RegionId id);
  void WriteReport(const std::filesystem::path& path);
  // Writes <folder>/<image name>.png of these views, edited; no names: of all views.
  void WriteViews(const std::filesystem::path& folder, const std::vector<std::string>& names = {});
  // Writes <folder>/0000.png, ...: a camera path. Then runs `done`. `replaced` is as in
  // ExportFrames().
  void WriteFrames(const std::filesystem::path& folder, std::vector<PosedCamera> cameras,
                   std::function<void()> done = {},
                   std::vector<std::filesystem::path> replaced = {});
  // Writes one picture: the scene before the edits on the left, edited on the right. `lens` is as
  // in FrameRequest.
  void WriteComparison(const std::filesystem::path& path, const PosedCamera& camera,
                       std::shared_ptr<const LensPicture> lens = nullptr);

 Q_SIGNALS:
  void sceneChecked(const std::vector<std::string>& warnings);
  void qualityReady(retint::RegionId id, const retint::QualityReport& report);
  void qualityGlanced(retint::RegionId id, const retint::QualityReport& report);
  void written(const QString& path);

 private:
  using Work = std::function<void(EditSession& session, Monitor& monitor)>;
  void RunWrite(const QString& label, const std::filesystem::path& path, Work work,
                std::function<void()> done = {});

  SceneController& scene_;
  quint64 measuring_ = 0;
};

}  // namespace retint
