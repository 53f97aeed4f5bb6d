// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/preferences_dialog.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDialogButtonBox>
#include <QFormLayout>
#include <QSettings>
#include <QSpinBox>

namespace retint {

Preferences Preferences::Load() {
  const QSettings settings;
  Preferences loaded;
  loaded.theme = ParseTheme(settings.value("theme").toString());
  loaded.automatic_refit = settings.value("automatic_refit", loaded.automatic_refit).toBool();
  loaded.frame_ms = settings.value("frame_ms", loaded.frame_ms).toInt();
  return loaded;
}

void Preferences::Save() const {
  QSettings settings;
  settings.setValue("theme", ThemeName(theme));
  settings.setValue("automatic_refit", automatic_refit);
  settings.setValue("frame_ms", frame_ms);
}

PreferencesDialog::PreferencesDialog(const Preferences& now, QWidget* parent) : QDialog(parent) {
  setObjectName("preferences");
  setAttribute(Qt::WA_DeleteOnClose);
  setWindowTitle(tr("Preferences"));
  auto* theme = new QComboBox;
  theme->setObjectName("preferred_theme");
  theme->addItem(tr("As the system"), "system");
  theme->addItem(tr("Light"), "light");
  theme->addItem(tr("Dark"), "dark");
  theme->setCurrentIndex(theme->findData(ThemeName(now.theme)));
  auto* automatic = new QCheckBox(tr("Start the &optimizer after each edit"));
  automatic->setObjectName("preferred_refit");
  automatic->setToolTip(tr("Otherwise edits show in closed form until the optimizer is started"));
  automatic->setChecked(now.automatic_refit);
  auto* frame = new QSpinBox;
  frame->setObjectName("preferred_frame");
  frame->setRange(10, 1000);
  frame->setSuffix(tr(" ms"));
  frame->setValue(now.frame_ms);
  frame->setKeyboardTracking(false);
  frame->setToolTip(
      tr("How long a picture may take while the camera moves. Less is smoother, more is sharper"));
  auto* form = new QFormLayout(this);
  form->addRow(tr("&Theme"), theme);
  form->addRow(tr("&Picture while moving"), frame);
  form->addRow(automatic);
  auto* close = new QDialogButtonBox(QDialogButtonBox::Close);
  connect(close, &QDialogButtonBox::rejected, this, &QDialog::reject);
  form->addRow(close);
  const auto say = [=, this] {
    Preferences chosen;
    chosen.theme = ParseTheme(theme->currentData().toString());
    chosen.automatic_refit = automatic->isChecked();
    chosen.frame_ms = frame->value();
    Q_EMIT changed(chosen);
  };
  connect(theme, &QComboBox::currentIndexChanged, this, say);
  connect(automatic, &QCheckBox::toggled, this, say);
  connect(frame, &QSpinBox::valueChanged, this, say);
}

}  // namespace retint
