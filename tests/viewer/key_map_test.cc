// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/key_map.h"

#include <fstream>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "viewer/selection/selection_keys.h"
#include "viewer/window/keys_dialog.h"
#include "viewer/window/panel_table.h"

namespace retint {
namespace {

// A key that means two things would do neither.
TEST(KeyMap, NoTwoCommandsShareAKey) {
  std::set<std::pair<QString, KeyContext>> seen;
  for (const Command& command : Commands()) {
    EXPECT_FALSE(KeysOf(command.id).isEmpty()) << command.id;
    for (const QKeySequence& key : KeysOf(command.id)) {
      ASSERT_EQ(key.count(), 1) << command.id;
      EXPECT_NE(key[0].key(), Qt::Key_unknown) << command.id;
      EXPECT_TRUE(seen.emplace(key.toString(), command.context).second) << command.id;
      if (command.context == KeyContext::kAlways) {
        EXPECT_TRUE(seen.emplace(key.toString(), KeyContext::kExplore).second) << command.id;
      } else {
        EXPECT_FALSE(seen.contains({key.toString(), KeyContext::kAlways})) << command.id;
      }
    }
  }
  for (const WindowPanel& panel : WindowPanels()) {
    for (const KeyContext context : {KeyContext::kAlways, KeyContext::kExplore}) {
      EXPECT_TRUE(seen.emplace(panel.Keys().front().toString(), context).second) << panel.id;
    }
  }
}

// "Window: Full screen: F11", in the order of the guide's table.
std::vector<std::string> GuideRows() {
  std::vector<std::string> rows;
  std::ifstream text(RETINT_SOURCE_DIR "/docs/viewer-keys.md");
  std::string line, group;
  while (std::getline(text, line)) {
    const QStringList cells = QString::fromStdString(line).split(" | ");
    if (!line.starts_with("| ") || cells.size() != 3 || cells[1] == "what") continue;
    const QString heading = QString(cells[0]).remove('|').remove('*').trimmed();
    if (!heading.isEmpty()) group = heading.toStdString();
    rows.push_back(group + ": " + cells[1].toStdString() + ": " +
                   cells[2].chopped(2).toStdString());
  }
  return rows;
}

TEST(KeyMap, TheGuidesTableIsTheKeyList) {
  std::vector<std::string> rows;
  for (const KeyRow& row : KeyRows()) {
    rows.push_back((row.group + ": " + row.what + ": " + row.keys).toStdString());
  }
  EXPECT_EQ(GuideRows(), rows);
}

// Every key of selection mode is listed, each key once.
TEST(KeyMap, SelectionKeysAreListed) {
  QStringList listed;
  for (const KeyRow& row : KeyRows()) {
    if (row.group != "Selection mode") continue;
    // A comma is a key too.
    listed += row.keys == "," ? QStringList{","} : row.keys.split(", ");
  }
  std::set<std::pair<int, int>> seen;
  for (const SelectionKey& key : SelectionKeys()) {
    EXPECT_TRUE(seen.emplace(key.key, int(key.modifiers)).second) << key.what;
    EXPECT_EQ(key.run != nullptr, key.act == SelectionAct::kRun) << key.what;
    const QKeyCombination keys(key.modifiers, Qt::Key(key.key));
    EXPECT_TRUE(listed.contains(QKeySequence(keys).toString())) << key.what;
  }
}

TEST(KeyMap, TheMouseIsSuperSplats) {
  EXPECT_EQ(GestureOf(Qt::LeftButton, {}), MouseGesture::kOrbit);
  EXPECT_EQ(GestureOf(Qt::RightButton, {}), MouseGesture::kPan);
  EXPECT_EQ(GestureOf(Qt::MiddleButton, {}), MouseGesture::kOrbit);
  EXPECT_EQ(GestureOf(Qt::MiddleButton, Qt::ShiftModifier), MouseGesture::kPan);
  EXPECT_EQ(GestureOf(Qt::MiddleButton, Qt::ControlModifier), MouseGesture::kZoom);
  EXPECT_EQ(GestureOf(Qt::RightButton, Qt::ControlModifier), std::nullopt);
}

TEST(KeyMap, FlyingIgnoresTheModifiersOfItsSpeed) {
  for (const auto modifiers : {Qt::KeyboardModifiers{}, Qt::KeyboardModifiers{Qt::ShiftModifier},
                               Qt::KeyboardModifiers{Qt::AltModifier}}) {
    ASSERT_NE(HeldCommand(Qt::Key_W, modifiers), nullptr);
    EXPECT_STREQ(HeldCommand(Qt::Key_W, modifiers)->id, "fly.forward");
  }
  EXPECT_EQ(HeldCommand(Qt::Key_W, Qt::ControlModifier), nullptr);  // closes the scene
  EXPECT_EQ(HeldCommand(Qt::Key_F, {}), nullptr);                   // not held
  // A key of its own with a modifier of flying goes before flying.
  EXPECT_TRUE(IsShortcut(Qt::ShiftModifier | Qt::Key_V));
  EXPECT_FALSE(IsShortcut(Qt::AltModifier | Qt::Key_S));
}

}  // namespace
}  // namespace retint
