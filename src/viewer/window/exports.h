// SPDX-License-Identifier: BSD-3-Clause
// Asks where to write splats, masks, views, reports, turntables and comparisons, and before
// replacing a file. Writes them through SceneResults.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include <QObject>
#include <QString>

#include "viewer/scene/scene_controller.h"
#include "viewer/window/window_parts.h"

class QWidget;

namespace retint {

class Exports : public QObject {
  Q_OBJECT

 public:
  Exports(const WindowParts& parts, QWidget* window);

  void Splat();
  void Masks();  // of the current region
  void Views();
  void Report();
  void Turntable();
  void Comparison();

  // The proposed folder of outputs: the last one used, otherwise beside the session or the
  // workspace. The name begins with that of the open scene and ends in `ending`.
  std::filesystem::path ProposedOutput(const QString& ending) const;
  static void RememberOutput(const std::filesystem::path& path);
  // Runs `go` at once if none of `files` exists, otherwise after the user agreed to replace them.
  void ConfirmReplacing(const std::filesystem::path& folder,
                        const std::vector<std::filesystem::path>& files, std::function<void()> go);
  void ConfirmReplacing(const std::filesystem::path& file, std::function<void()> go);

 Q_SIGNALS:
  void said(const QString& text);  // for the status bar
  void written();                  // a file of the user's

 private:
  void MakeVideo(const std::filesystem::path& folder, const std::filesystem::path& video, int rate);

  QWidget* window_;
  const WindowParts parts_;
};

}  // namespace retint
