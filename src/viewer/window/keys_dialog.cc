// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/keys_dialog.h"

#include <QDialogButtonBox>
#include <QHeaderView>
#include <QScreen>
#include <QTableWidget>
#include <QVBoxLayout>

#include "viewer/selection/selection_keys.h"
#include "viewer/widgets/key_map.h"
#include "viewer/window/panel_table.h"

namespace retint {
namespace {

// Mouse hints, which are not keys.
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

// Keys with the same meaning share a row.
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

std::vector<KeyRow> KeyRows() {
  std::vector<KeyRow> rows;
  const auto mouse = [&](const char* what, const QString& text) {
    if (!text.isEmpty()) rows.push_back({"Mouse", what, text});
  };
  mouse("Orbit around what is under the cursor", MouseText(MouseGesture::kOrbit));
  mouse("Pan", MouseText(MouseGesture::kPan));
  mouse("Zoom", "wheel, " + MouseText(MouseGesture::kZoom));
  mouse("Look around", MouseText(MouseGesture::kLook));
  mouse("Look at it; go to a camera's view", "double-click");
  for (const Command& command : Commands()) {
    if (std::string_view(command.id) == "window.panels") {
      for (const WindowPanel& panel : WindowPanels()) {
        rows.push_back({command.group, panel.Aim(), KeyText(panel.Keys())});
      }
    }
    rows.push_back({command.group, command.title, KeyText(command.id)});
    if (std::string_view(command.id) == "fly.up") {
      rows.push_back({command.group, "Ten times faster, slower", "hold Shift, Alt"});
    }
  }
  const auto selection = SelectionRows();
  rows.insert(rows.end(), selection.begin(), selection.end());
  rows.insert(rows.end(), std::begin(kRegionRows), std::end(kRegionRows));
  return rows;
}

KeysDialog::KeysDialog(QWidget* parent) : QDialog(parent) {
  setWindowTitle(tr("Keys"));
  resize(FirstSize(screen()->availableSize(), fontMetrics()));
  auto* table = new QTableWidget;
  table->setColumnCount(2);
  table->setHorizontalHeaderLabels({tr("What"), tr("Keys")});
  table->verticalHeader()->hide();
  table->setEditTriggers(QAbstractItemView::NoEditTriggers);
  table->setSelectionMode(QAbstractItemView::NoSelection);
  table->setShowGrid(false);
  table->setAlternatingRowColors(true);
  table->horizontalHeader()->setSectionResizeMode(QHeaderView::Stretch);
  QString group;
  for (const KeyRow& row : KeyRows()) {
    if (row.group != group) {
      group = row.group;
      const int at = table->rowCount();
      table->insertRow(at);
      auto* heading = new QTableWidgetItem(group);
      QFont bold = heading->font();
      bold.setBold(true);
      heading->setFont(bold);
      table->setItem(at, 0, heading);
      table->setSpan(at, 0, 1, 2);
    }
    const int at = table->rowCount();
    table->insertRow(at);
    table->setItem(at, 0, new QTableWidgetItem(row.what));
    table->setItem(at, 1, new QTableWidgetItem(row.keys));
  }
  auto* close = new QDialogButtonBox(QDialogButtonBox::Close);
  connect(close, &QDialogButtonBox::rejected, this, &QDialog::reject);
  auto* layout = new QVBoxLayout(this);
  layout->addWidget(table);
  layout->addWidget(close);
}

// The window frame needs some of the room.
QSize KeysDialog::FirstSize(const QSize& room, const QFontMetrics& font) {
  constexpr int kWide = 88, kHigh = 44;  // characters, lines
  constexpr QSize kAround(24, 72);
  const QSize wanted(kWide * font.averageCharWidth(), kHigh * font.lineSpacing());
  return wanted.boundedTo(room - kAround);
}

}  // namespace retint
