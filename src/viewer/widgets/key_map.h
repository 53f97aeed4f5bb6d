// SPDX-License-Identifier: BSD-3-Clause
// What the window can be told by key and mouse, and which keys and buttons mean it: SuperSplat's.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <QKeySequence>
#include <QList>
#include <QString>

namespace retint {

// Where a key counts. Two commands of one context may not share a key, nor with kAlways.
enum class KeyContext { kAlways, kExplore };

struct Command {
  const char* id;     // "camera.frame"
  const char* group;  // heading in the key list
  const char* title;  // "Frame selection or scene"
  KeyContext context;
  bool held;         // acts while the key is down; else once
  const char* keys;  // as Qt writes them: "Ctrl+Shift+Z, Ctrl+Y"
};

// All of them, in the order of the key list.
const std::vector<Command>& Commands();
const Command* FindCommand(std::string_view id);

// What dragging does.
enum class MouseGesture { kOrbit, kPan, kZoom, kLook };

QList<QKeySequence> KeysOf(std::string_view command);
// "F, Home", as the user's system writes them.
QString KeyText(std::string_view command);
// "right drag, Shift+left drag".
QString MouseText(MouseGesture gesture);
// The gesture of a drag with exactly these modifiers.
std::optional<MouseGesture> GestureOf(Qt::MouseButton button, Qt::KeyboardModifiers modifiers);
// The held command of a key. Shift and Alt do not count: they change how fast one flies.
const Command* HeldCommand(int key, Qt::KeyboardModifiers modifiers);
// Whether exactly this is a key of a command that is not held.
bool IsShortcut(QKeyCombination key);

}  // namespace retint
