// SPDX-License-Identifier: BSD-3-Clause
// The choices of the user for every scene. A choice acts at once and is kept.
#pragma once

#include <QDialog>

#include "viewer/window/theme.h"

namespace retint {

struct Preferences {
  ThemeChoice theme = ThemeChoice::kSystem;
  bool automatic_refit = true;
  QString overlay;  // one of kOverlayNames; empty: by contrast
  int scale = 100;  // of the interface, percent; from the next start on
  // The tool Object asks a network of the user's own: a model, or SAM's encoder and decoder.
  QString network, decoder, onnx_runtime;  // paths; `network` may also be exec:COMMAND
  int frame_ms = 60;                       // that a picture may take while the camera moves

  static Preferences Load();  // from the settings
  void Save() const;
  QString NetworkName() const;  // as MakeMaskNetwork() takes it; empty: none
};

class PreferencesDialog : public QDialog {
  Q_OBJECT

 public:
  explicit PreferencesDialog(const Preferences& now, QWidget* parent = nullptr);

 Q_SIGNALS:
  void changed(const retint::Preferences& preferences);
};

}  // namespace retint
