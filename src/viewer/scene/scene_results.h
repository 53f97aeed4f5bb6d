// SPDX-License-Identifier: BSD-3-Clause
// What is measured of an open scene, and the files that are written of it. Each call queues a task
// of the controller. What is written has the colors of every region that is not hidden, whatever
// SceneController::solo() is.
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
  // Says whether what was measured is of the edit that shows; empty: there is no such region.
  std::string EditKey(RegionId id) const;
  // The same on a few views, quickly: qualityGlanced().
  void Glance(RegionId id);
  // Whether the splat and the workspace belong together: sceneChecked(). Renders a few small views.
  void Check();

  void WriteSplat(const std::filesystem::path& path);
  void WriteMasks(const std::filesystem::path& folder, RegionId id);
  void WriteReport(const std::filesystem::path& path);
  // <folder>/<image name>.png of these views (none named: every one), edited.
  void WriteViews(const std::filesystem::path& folder, const std::vector<std::string>& names = {});
  // <folder>/0000.png, ...: a camera path. `done` runs once they are written. `replaced` as in
  // ExportFrames().
  void WriteFrames(const std::filesystem::path& folder, std::vector<PosedCamera> cameras,
                   std::function<void()> done = {},
                   std::vector<std::filesystem::path> replaced = {});
  // One picture: the scene before the edits on the left, edited on the right.
  // `lens` as for a FrameRequest.
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
