// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/preferences_dialog.h"

#include <algorithm>

#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDialogButtonBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QSettings>
#include <QSpinBox>
#include <QStyle>

#include "viewer/canvas/overlay_color.h"
#include "viewer/widgets/icon.h"
#include "viewer/widgets/path_edit.h"

namespace retint {
namespace {

constexpr int kLeastScale = 100, kMostScale = 300;  // percent

}  // namespace

Preferences Preferences::Load() {
  const QSettings settings;
  Preferences loaded;
  loaded.theme = ParseTheme(settings.value("theme").toString());
  loaded.automatic_refit = settings.value("automatic_refit", loaded.automatic_refit).toBool();
  loaded.frame_ms = settings.value("frame_ms", loaded.frame_ms).toInt();
  loaded.overlay = settings.value("overlay").toString();
  loaded.network = settings.value("network").toString();
  loaded.decoder = settings.value("network_decoder").toString();
  loaded.onnx_runtime = settings.value("onnx_runtime").toString();
  loaded.scale = std::clamp(settings.value("scale", loaded.scale).toInt(), kLeastScale, kMostScale);
  return loaded;
}

void Preferences::Save() const {
  QSettings settings;
  settings.setValue("theme", ThemeName(theme));
  settings.setValue("automatic_refit", automatic_refit);
  settings.setValue("frame_ms", frame_ms);
  settings.setValue("overlay", overlay);
  settings.setValue("network", network);
  settings.setValue("network_decoder", decoder);
  settings.setValue("onnx_runtime", onnx_runtime);
  settings.setValue("scale", scale);
}

QString Preferences::NetworkName() const {
  if (network.isEmpty() || network.startsWith("exec:") || network.startsWith("onnx:")) {
    return network;
  }
  return "onnx:" + network + (decoder.isEmpty() ? QString() : "," + decoder);
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
  auto* overlay = new QComboBox;
  overlay->setObjectName("preferred_overlay");
  overlay->setToolTip(tr("The color of what is painted and of masks"));
  overlay->addItem(tr("Stands out from the picture"), QString());
  for (const char* name : kOverlayNames) {
    overlay->addItem(tr(name).left(1).toUpper() + tr(name).mid(1), name);
  }
  overlay->setCurrentIndex(std::max(0, overlay->findData(now.overlay)));
  auto* scale = new QSpinBox;
  scale->setObjectName("preferred_scale");
  scale->setRange(kLeastScale, kMostScale);
  scale->setSingleStep(25);
  scale->setSuffix(tr(" %"));
  scale->setValue(now.scale);
  scale->setKeyboardTracking(false);
  scale->setToolTip(tr("The size of text and controls, from the next start on"));
  const auto path = [this](const char* name, const QString& text, const QString& hint,
                           const QString& tip) {
    auto* edit = new PathEdit(text);
    edit->setObjectName(name);
    edit->setPlaceholderText(hint);
    edit->setToolTip(tip);
    auto* choose = edit->addAction(MakeIcon("folder", palette()), QLineEdit::TrailingPosition);
    choose->setToolTip(tr("Choose a file"));
    connect(choose, &QAction::triggered, edit, [this, edit] {
      const QString file = QFileDialog::getOpenFileName(this, tr("Choose a file"), edit->text());
      if (!file.isEmpty()) edit->setText(file);
    });
    return edit;
  };
  auto* network = path("preferred_network", now.network, tr("model.onnx"),
                       tr("The model that the tool Object asks: one that finds the salient object, "
                          "or the encoder of one that takes clicks; or exec:COMMAND"));
  auto* decoder = path("preferred_decoder", now.decoder, tr("decoder.onnx, if it takes clicks"),
                       tr("The second file of a network that takes clicks, such as SAM"));
  auto* runtime = path("preferred_runtime", now.onnx_runtime, tr("where it usually is"),
                       tr("The library libonnxruntime.so, or its folder"));
  auto* form = new QFormLayout(this);
  form->addRow(tr("&Theme"), theme);
  form->addRow(tr("&Size of the interface"), scale);
  form->addRow(tr("&Overlay color"), overlay);
  form->addRow(tr("Longest &picture while moving"), frame);
  form->addRow(automatic);
  form->addRow(tr("Object &network"), network);
  form->addRow(tr("Its &decoder"), decoder);
  form->addRow(tr("ONNX &Runtime"), runtime);
  auto* close = new QDialogButtonBox(QDialogButtonBox::Close);
  connect(close, &QDialogButtonBox::rejected, this, &QDialog::reject);
  form->addRow(close);
  const auto say = [=, this] {
    Preferences chosen;
    chosen.theme = ParseTheme(theme->currentData().toString());
    chosen.automatic_refit = automatic->isChecked();
    chosen.frame_ms = frame->value();
    chosen.overlay = overlay->currentData().toString();
    chosen.scale = scale->value();
    chosen.network = network->text().trimmed();
    chosen.decoder = decoder->text().trimmed();
    chosen.onnx_runtime = runtime->text().trimmed();
    Q_EMIT changed(chosen);
  };
  connect(theme, &QComboBox::currentIndexChanged, this, say);
  connect(overlay, &QComboBox::currentIndexChanged, this, say);
  connect(scale, &QSpinBox::valueChanged, this, say);
  connect(automatic, &QCheckBox::toggled, this, say);
  connect(frame, &QSpinBox::valueChanged, this, say);
  for (PathEdit* edit : {network, decoder, runtime}) {
    connect(edit, &QLineEdit::textChanged, this, say);
  }
}

}  // namespace retint
