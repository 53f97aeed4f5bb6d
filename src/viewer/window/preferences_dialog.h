// SPDX-License-Identifier: BSD-3-Clause
// The user's choices for all scenes. Choices act at once, and are saved.
#pragma once

#include <QDialog>

#include "viewer/window/theme.h"

namespace retint {

struct Preferences {
  ThemeChoice theme = ThemeChoice::kSystem;
  bool automatic_refit = true;
  QString overlay;  // one of kOverlayNames; empty: chosen by contrast
  int scale = 100;  // of the interface, percent; from the next start
  // For the tool Object, the user's own network: a model, or encoder and decoder of SAM.
  QString network, decoder, onnx_runtime;  // paths; `network` may also be exec:COMMAND
  int frame_ms = 40;                       // longest time for a picture while the camera moves

  static Preferences Load();  // from the settings
  void Save() const;
  QString NetworkName() const;  // for MakeMaskNetwork(); empty: none
};

class PreferencesDialog : public QDialog {
  Q_OBJECT

 public:
  explicit PreferencesDialog(const Preferences& now, QWidget* parent = nullptr);

 Q_SIGNALS:
  void changed(const retint::Preferences& preferences);
};

}  // namespace retint
