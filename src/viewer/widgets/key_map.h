// SPDX-License-Identifier: BSD-3-Clause
// The commands of keys and mouse in the window, and their keys and buttons, which are SuperSplat's.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <QKeySequence>
#include <QList>
#include <QString>

namespace retint {

// Where a key works. Two commands of one context, or one and kAlways, must not share a key.
enum class KeyContext { kAlways, kExplore };

struct Command {
  const char* id;     // "camera.frame"
  const char* group;  // heading in the key list
  const char* title;  // "Frame selection or scene"
  KeyContext context;
  bool held;         // acts as long as the key is down, otherwise once
  const char* keys;  // in Qt's notation: "Ctrl+Shift+Z, Ctrl+Y"
};

// All commands but the panels' (viewer/window/panel_table.h), in the order of the key list.
const std::vector<Command>& Commands();
const Command* FindCommand(std::string_view id);

// The effect of a drag.
enum class MouseGesture { kOrbit, kPan, kZoom, kLook };

QList<QKeySequence> KeysOf(std::string_view command);
// "F, Home", in the notation of the user's system.
QString KeyText(const QList<QKeySequence>& keys);
QString KeyText(std::string_view command);
// "right drag, Shift+left drag".
QString MouseText(MouseGesture gesture);
// The gesture of a drag with exactly these modifiers.
std::optional<MouseGesture> GestureOf(Qt::MouseButton button, Qt::KeyboardModifiers modifiers);
// The held command of a key. Ignores Shift and Alt, which change the speed of flying.
const Command* HeldCommand(int key, Qt::KeyboardModifiers modifiers);
// Whether this is the key of a command that is not held.
bool IsShortcut(QKeyCombination key);

}  // namespace retint
