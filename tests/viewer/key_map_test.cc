// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/key_map.h"

#include <fstream>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "viewer/selection/selection_keys.h"
#include "viewer/window/keys_dialog.h"

namespace retint {
namespace {

using testing::HasSubstr;

std::string FaultOf(const char* json) {
  try {
    KeyMap::FromJson(json, "my.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

TEST(KeyMap, BuiltInProfilesHaveNoConflicts) {
  for (const QString& name : KeyMap::BuiltIn()) {
    const KeyMap map = KeyMap::Named(name);
    EXPECT_EQ(map.name(), name);
    EXPECT_TRUE(map.Conflicts().isEmpty()) << map.Conflicts().join("; ").toStdString();
  }
}

TEST(KeyMap, EveryCommandOfTheDefaultHasAKey) {
  const KeyMap map = KeyMap::Named("SuperSplat");
  for (const Command& command : Commands())
    EXPECT_FALSE(map.Keys(command.id).isEmpty()) << command.id;
}

std::string Guide() {
  std::ifstream file(std::string(RETINT_SOURCE_DIR) + "/docs/viewer-keys.md");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

// "Window: Full screen: F11", in the order of the guide's table.
std::vector<std::string> GuideRows() {
  std::vector<std::string> rows;
  std::istringstream text(Guide());
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
  for (const KeyRow& row : KeyRows(KeyMap::Named("SuperSplat"))) {
    rows.push_back((row.group + ": " + row.what + ": " + row.keys).toStdString());
  }
  EXPECT_EQ(GuideRows(), rows);
  for (const Command& command : Commands()) {
    EXPECT_THAT(Guide(), HasSubstr("`" + std::string(command.id) + "`"));
  }
}

// Every key of selection mode is listed, each key once.
TEST(KeyMap, SelectionKeysAreListed) {
  QStringList listed;
  for (const KeyRow& row : KeyRows(KeyMap::Named("SuperSplat"))) {
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

TEST(KeyMap, AnUnknownProfileIsTheDefault) {
  EXPECT_EQ(KeyMap::Named("Nobody").name(), "SuperSplat");
}

TEST(KeyMap, DefaultMouseIsSuperSplats) {
  const KeyMap map = KeyMap::Named("SuperSplat");
  EXPECT_EQ(map.Gesture(Qt::LeftButton, {}), MouseGesture::kOrbit);
  EXPECT_EQ(map.Gesture(Qt::RightButton, {}), MouseGesture::kPan);
  EXPECT_EQ(map.Gesture(Qt::MiddleButton, {}), MouseGesture::kOrbit);
  EXPECT_EQ(map.Gesture(Qt::MiddleButton, Qt::ShiftModifier), MouseGesture::kPan);
  EXPECT_EQ(map.Gesture(Qt::MiddleButton, Qt::ControlModifier), MouseGesture::kZoom);
  EXPECT_EQ(map.Gesture(Qt::RightButton, Qt::ControlModifier), std::nullopt);
}

TEST(KeyMap, FlyingIgnoresTheModifiersOfItsSpeed) {
  const KeyMap map = KeyMap::Named("SuperSplat");
  for (const auto modifiers : {Qt::KeyboardModifiers{}, Qt::KeyboardModifiers{Qt::ShiftModifier},
                               Qt::KeyboardModifiers{Qt::AltModifier}}) {
    ASSERT_NE(map.Held(Qt::Key_W, modifiers), nullptr);
    EXPECT_STREQ(map.Held(Qt::Key_W, modifiers)->id, "fly.forward");
  }
  EXPECT_EQ(map.Held(Qt::Key_W, Qt::ControlModifier), nullptr);  // closes the scene
  EXPECT_EQ(map.Held(Qt::Key_F, {}), nullptr);                   // not held
}

TEST(KeyMap, AProfileSaysWhatDiffersFromItsBase) {
  const KeyMap map = KeyMap::FromJson(
      R"({"name": "Mine", "base": "Blender", "keys": {"view.next": ["PgDown"], "show.depth": []},
          "mouse": {"pan": ["Right"], "look": []}})",
      "my.json");
  EXPECT_EQ(map.name(), "Mine");
  EXPECT_EQ(map.Keys("view.next"), QList<QKeySequence>{QKeySequence(Qt::Key_PageDown)});
  EXPECT_TRUE(map.Keys("show.depth").isEmpty());
  EXPECT_EQ(map.Keys("camera.frame"), KeyMap::Named("Blender").Keys("camera.frame"));
  EXPECT_EQ(map.Gesture(Qt::RightButton, {}), MouseGesture::kPan);
  EXPECT_EQ(map.Gesture(Qt::MiddleButton, {}), MouseGesture::kOrbit);
  EXPECT_TRUE(map.Conflicts().isEmpty());
}

TEST(KeyMap, ConflictsAreNamed) {
  const KeyMap keys = KeyMap::FromJson(
      R"({"name": "Mine", "base": "SuperSplat", "keys": {"show.depth": ["F"]}})", "my.json");
  ASSERT_EQ(keys.Conflicts().size(), 1);
  EXPECT_THAT(keys.Conflicts().front().toStdString(), HasSubstr("Depth"));
  EXPECT_THAT(keys.Conflicts().front().toStdString(), HasSubstr("Frame"));
  const KeyMap mouse = KeyMap::FromJson(
      R"({"name": "Mine", "base": "SuperSplat", "mouse": {"zoom": ["Left"]}})", "my.json");
  ASSERT_EQ(mouse.Conflicts().size(), 1);
  EXPECT_THAT(mouse.Conflicts().front().toStdString(), HasSubstr("left drag"));
}

TEST(KeyMap, WhatIsInConflictDoesNotAct) {
  const KeyMap keys = KeyMap::FromJson(
      R"({"name": "Mine", "base": "SuperSplat",
          "keys": {"show.depth": ["W", "J"], "view.next": ["Alt+3"], "camera.reset": ["Shift+S"]},
          "mouse": {"zoom": ["Left"]}})",
      "my.json");
  const std::string conflicts = keys.Conflicts().join("\n").toStdString();
  EXPECT_THAT(conflicts, HasSubstr("Fly forward"));
  EXPECT_THAT(conflicts, HasSubstr("Go to the Quality panel"));
  EXPECT_EQ(keys.Held(Qt::Key_W, {}), nullptr);
  EXPECT_EQ(keys.ActiveKeys("show.depth"), QList<QKeySequence>{QKeySequence(Qt::Key_J)});
  EXPECT_TRUE(keys.ActiveKeys("view.next").isEmpty());
  EXPECT_TRUE(keys.ActiveKeys("panel.quality").isEmpty());
  EXPECT_EQ(keys.Gesture(Qt::LeftButton, {}), std::nullopt);
  EXPECT_EQ(keys.Gesture(Qt::MiddleButton, {}), MouseGesture::kOrbit);
  // A key of its own with a modifier of flying goes before flying.
  EXPECT_TRUE(keys.IsShortcut(Qt::ShiftModifier | Qt::Key_S));
  EXPECT_FALSE(keys.IsShortcut(Qt::AltModifier | Qt::Key_S));
}

TEST(KeyMap, FaultsAreNamed) {
  EXPECT_THAT(FaultOf(""), HasSubstr("my.json"));
  EXPECT_THAT(FaultOf("[]"), HasSubstr("not a JSON object"));
  EXPECT_THAT(FaultOf("{}"), HasSubstr("no name"));
  EXPECT_THAT(FaultOf(R"({"name": "x", "base": "Maya"})"), HasSubstr("unknown base"));
  EXPECT_THAT(FaultOf(R"({"name": "x", "keys": {"fly.sideways": ["K"]}})"),
              HasSubstr("fly.sideways"));
  EXPECT_THAT(FaultOf(R"({"name": "x", "keys": {"view.next": "K"}})"), HasSubstr("list"));
  EXPECT_THAT(FaultOf(R"({"name": "x", "keys": {"view.next": [7]}})"), HasSubstr("list"));
  EXPECT_THAT(FaultOf(R"({"name": "x", "keys": {"view.next": ["Bogus+Q+"]}})"),
              HasSubstr("no key"));
  EXPECT_THAT(FaultOf(R"({"name": "x", "mouse": {"pan": ["Ctrl"]}})"),
              HasSubstr("no mouse button"));
  EXPECT_THAT(FaultOf(R"({"name": "x", "mouse": {"spin": ["Left"]}})"), HasSubstr("spin"));
}

}  // namespace
}  // namespace retint
