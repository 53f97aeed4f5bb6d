// SPDX-License-Identifier: BSD-3-Clause
// Opens scenes and sessions, saves sessions, and asks before work would be lost. Questions do not
// block the program: the answer arrives later.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <QObject>
#include <QString>
#include <QStringList>

#include "viewer/scene/scene_controller.h"
#include "viewer/window/window_parts.h"

class QMenu;
class QWidget;

namespace retint {

class Exports;
class SampleScene;

// The requests of the command line.
struct StartOptions {
  OpenRequest scene;              // empty paths: not given
  std::filesystem::path session;  // NAME.retint
  QString problem;                // why the given files cannot be opened; empty: they can
};

class SceneFiles : public QObject {
  Q_OBJECT

 public:
  SceneFiles(const WindowParts& parts, Exports* exports, QWidget* window);

  // After show(): opens the requested scene, or offers unsaved work; asks for missing parts.
  void Start(const StartOptions& options);
  void PrepareSample();  // in the background
  void OpenSample();
  void OpenScene(const OpenRequest& request) { OpenRequested(request, /*from_form=*/false); }
  void OpenPaths(const QStringList& paths);  // as if dropped
  // Empty: asks which.
  void OpenSession(const std::filesystem::path& folder, const std::string& backend = "auto");
  // `failure`: why the files that `start` names could not be opened.
  void AskAndOpen(OpenRequest start, const QString& failure = {});
  // Of the list of recent files; see recent_files.h.
  void OpenRecent(const QString& entry);
  void Forget(const QString& entry);
  void FillRecent(QMenu* menu);

  // `then` runs once it is saved. `as`: asks where.
  void Save(bool as, std::function<void()> then = {});
  // Of a region, into another splat, which is then open.
  void SplitGaussians(RegionId region);

  // Runs `go` at once, or after the user agreed to lose or save unsaved work.
  void ConfirmThen(const QString& what, std::function<void()> go, bool quits = false);
  // Runs `go`, which discards paint that was not accepted: at once if there is none.
  void AskOfPaint(const QString& what, std::function<void()> go);

 Q_SIGNALS:
  void said(const QString& text);  // for the status bar
  void recentChanged();            // the list of recent files

 private:
  void OpenRequested(const OpenRequest& request, bool from_form);
  void OpenStart(const StartOptions& options);
  void OnOpenFailed(const QString& message);
  void OfferRecovery(const StartOptions& options, std::function<void()> otherwise);
  void KeepPicture();  // of the open scene, for the start page
  void SaveAgain(std::function<void()> then);
  void SplitInto(RegionId region, const QString& path);
  QString LossOfPaint() const;  // a reason to ask

  QWidget* window_;
  const WindowParts parts_;
  Exports* exports_;
  std::shared_ptr<SampleScene> sample_;
  QString opening_;                  // entry of the recent files, once it has opened
  std::optional<OpenRequest> form_;  // of the dialog, until it has opened
};

}  // namespace retint
