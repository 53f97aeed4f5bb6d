// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/key_map.h"

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "viewer/keys_dialog.h"

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

TEST(KeyMap, TheGuideListsEveryKey) {
  std::ifstream file(std::string(RETINT_SOURCE_DIR) + "/docs/viewer.md");
  std::stringstream text;
  text << file.rdbuf();
  for (const KeyRow& row : KeyRows(KeyMap::Named("SuperSplat"))) {
    EXPECT_THAT(text.str(), HasSubstr(("| " + row.what + " | " + row.keys + " |").toStdString()));
  }
  for (const Command& command : Commands()) {
    EXPECT_THAT(text.str(), HasSubstr("`" + std::string(command.id) + "`"));
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
