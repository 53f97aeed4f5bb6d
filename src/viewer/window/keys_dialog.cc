// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/keys_dialog.h"

#include <QComboBox>
#include <QDialogButtonBox>
#include <QFileDialog>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QPushButton>
#include <QScreen>
#include <QTableWidget>
#include <QVBoxLayout>

#include "viewer/selection/selection_keys.h"

namespace retint {
namespace {

// What keys alone do not say; the same in every profile.
const KeyRow kSelectionMouse[] = {
    {"Selection mode", "Erase with the brush", "hold Ctrl"},
    {"Selection mode", "Scribble on what is not the object", "hold Ctrl"},
    {"Selection mode", "Add, remove, intersect", "hold Shift, Ctrl, Shift+Ctrl"},
    {"Selection mode", "Brush size", "Alt+wheel"},
    {"Selection mode", "Wand, like this color: more or less alike", "drag right, left"},
    {"Selection mode", "Close the outline", "double-click, click on its first corner"},
    {"Selection mode", "Zoom at the cursor", "wheel"},
    {"Selection mode", "Pan", "right drag, middle drag"},
};
const KeyRow kRegionRows[] = {
    {"List of regions", "Hide or show", "Space"},
    {"List of regions", "Rename", "F2, double-click"},
    {"List of regions", "Duplicate", "Ctrl+D"},
    {"List of regions", "Delete", "Del"},
    {"List of regions", "Move up, down", "Alt+Up, Alt+Down, drag"},
};

// Keys of one meaning in one row.
std::vector<KeyRow> SelectionRows() {
  std::vector<KeyRow> rows;
  for (const SelectionKey& key : SelectionKeys()) {
    const QString text = QKeySequence(QKeyCombination(key.modifiers, Qt::Key(key.key))).toString();
    if (!rows.empty() && rows.back().what == key.what) {
      rows.back().keys += ", " + text;
    } else {
      rows.push_back({"Selection mode", key.what, text});
    }
  }
  rows.insert(rows.end(), std::begin(kSelectionMouse), std::end(kSelectionMouse));
  return rows;
}

}  // namespace

std::vector<KeyRow> KeyRows(const KeyMap& keys) {
  std::vector<KeyRow> rows;
  const auto mouse = [&](const char* what, const QString& text) {
    if (!text.isEmpty()) rows.push_back({"Mouse", what, text});
  };
  mouse("Orbit around what is under the cursor", keys.MouseText(MouseGesture::kOrbit));
  mouse("Pan", keys.MouseText(MouseGesture::kPan));
  mouse("Zoom", "wheel, " + keys.MouseText(MouseGesture::kZoom));
  mouse("Look around", keys.MouseText(MouseGesture::kLook));
  mouse("Look at it; go to a camera's view", "double-click");
  for (const Command& command : Commands()) {
    rows.push_back({command.group, command.title, keys.KeyText(command.id)});
    if (std::string_view(command.id) == "fly.up") {
      rows.push_back({command.group, "Ten times faster, slower", "hold Shift, Alt"});
    }
  }
  const auto selection = SelectionRows();
  rows.insert(rows.end(), selection.begin(), selection.end());
  rows.insert(rows.end(), std::begin(kRegionRows), std::end(kRegionRows));
  return rows;
}

KeysDialog::KeysDialog(const KeyMap& keys, const QStringList& profiles, QWidget* parent)
    : QDialog(parent) {
  setWindowTitle(tr("Keys"));
  resize(FirstSize(screen()->availableSize(), fontMetrics()));
  profile_ = new QComboBox;
  profile_->setObjectName("profile");
  profile_->addItems(profiles);
  auto* file = new QPushButton(tr("Load a profile…"));
  file->setAutoDefault(false);
  conflicts_ = new QLabel;
  conflicts_->setObjectName("conflicts");
  conflicts_->setWordWrap(true);
  table_ = new QTableWidget;
  table_->setColumnCount(2);
  table_->setHorizontalHeaderLabels({tr("What"), tr("Keys")});
  table_->verticalHeader()->hide();
  table_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  table_->setSelectionMode(QAbstractItemView::NoSelection);
  table_->setShowGrid(false);
  table_->setAlternatingRowColors(true);
  table_->horizontalHeader()->setSectionResizeMode(QHeaderView::Stretch);
  auto* top = new QHBoxLayout;
  top->addWidget(new QLabel(tr("Profile")));
  top->addWidget(profile_);
  top->addStretch();
  top->addWidget(file);
  auto* close = new QDialogButtonBox(QDialogButtonBox::Close);
  connect(close, &QDialogButtonBox::rejected, this, &QDialog::reject);
  auto* layout = new QVBoxLayout(this);
  layout->addLayout(top);
  layout->addWidget(conflicts_);
  layout->addWidget(table_);
  layout->addWidget(close);
  connect(profile_, &QComboBox::textActivated, this, &KeysDialog::profileChosen);
  connect(file, &QPushButton::clicked, this, [this] {
    const QString path =
        QFileDialog::getOpenFileName(this, tr("Key map profile"), {}, tr("Profiles (*.json)"));
    if (!path.isEmpty()) Q_EMIT fileChosen(path);
  });
  Show(keys);
}

// A frame takes a part of the room.
QSize KeysDialog::FirstSize(const QSize& room, const QFontMetrics& font) {
  constexpr int kWide = 88, kHigh = 44;  // characters, lines
  constexpr QSize kAround(24, 72);
  const QSize wanted(kWide * font.averageCharWidth(), kHigh * font.lineSpacing());
  return wanted.boundedTo(room - kAround);
}

void KeysDialog::Show(const KeyMap& keys) {
  if (profile_->findText(keys.name()) < 0) profile_->addItem(keys.name());
  profile_->setCurrentText(keys.name());
  const QStringList conflicts = keys.Conflicts();
  conflicts_->setVisible(!conflicts.isEmpty());
  conflicts_->setText(
      tr("Conflicts: %1. A key with two meanings does nothing.").arg(conflicts.join("; ")));
  const auto rows = KeyRows(keys);
  table_->setRowCount(0);
  QString group;
  for (const KeyRow& row : rows) {
    if (row.group != group) {
      group = row.group;
      const int at = table_->rowCount();
      table_->insertRow(at);
      auto* heading = new QTableWidgetItem(group);
      QFont bold = heading->font();
      bold.setBold(true);
      heading->setFont(bold);
      table_->setItem(at, 0, heading);
      table_->setSpan(at, 0, 1, 2);
    }
    const int at = table_->rowCount();
    table_->insertRow(at);
    table_->setItem(at, 0, new QTableWidgetItem(row.what));
    table_->setItem(at, 1, new QTableWidgetItem(row.keys));
  }
}

}  // namespace retint
