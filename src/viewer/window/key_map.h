// SPDX-License-Identifier: BSD-3-Clause
// What the window can be told by key and mouse, and which keys and buttons mean it. A profile is a
// JSON object:
//
//   { "name": "Blender", "base": "SuperSplat",
//     "keys":  { "view.next": ["Right"], "camera.frame": ["Home", "Period"] },
//     "mouse": { "orbit": ["Middle"], "pan": ["Shift+Middle"] } }
//
// Keys are written as Qt does ("Ctrl+Shift+Z"), buttons as Left, Middle, Right with modifiers.
// A profile says only what differs from its base; an empty list takes a key away.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <QKeySequence>
#include <QList>
#include <QString>
#include <QStringList>

namespace retint {

// Where a key counts. Two commands of one context may not share a key, nor with kAlways.
enum class KeyContext { kAlways, kExplore };

struct Command {
  const char* id;     // "camera.frame"
  const char* group;  // heading in the key list
  const char* title;  // "Frame selection or scene"
  KeyContext context;
  bool held;  // acts while the key is down; else once
};

// All of them, in the order of the key list.
const std::vector<Command>& Commands();
const Command* FindCommand(std::string_view id);

// What dragging does.
enum class MouseGesture { kOrbit, kPan, kZoom, kLook };

struct MouseBinding {
  Qt::MouseButton button = Qt::NoButton;
  Qt::KeyboardModifiers modifiers = Qt::NoModifier;
  bool operator==(const MouseBinding&) const = default;
};

class KeyMap {
 public:
  // "SuperSplat", "LichtFeld", "Blender".
  static QStringList BuiltIn();
  // One of BuiltIn(); the default for any other name.
  static KeyMap Named(const QString& name);
  // InputError naming `path` and the fault: bad JSON, an unknown command, key, button or base.
  static KeyMap FromJson(const QByteArray& json, const std::string& path);

  const QString& name() const { return name_; }
  QList<QKeySequence> Keys(std::string_view command) const;
  // Those of them that mean nothing else: where two commands have one key, neither acts.
  QList<QKeySequence> ActiveKeys(std::string_view command) const;
  // "F, Home", as the user's system writes them.
  QString KeyText(std::string_view command) const;
  QString MouseText(MouseGesture gesture) const;
  // The gesture of a drag; a binding with exactly these modifiers.
  std::optional<MouseGesture> Gesture(Qt::MouseButton button,
                                      Qt::KeyboardModifiers modifiers) const;
  // The held command of a key. Shift and Alt do not count: they change how fast one flies.
  const Command* Held(int key, Qt::KeyboardModifiers modifiers) const;
  // Whether exactly this is a key of a command that is not held.
  bool IsShortcut(QKeyCombination key) const;
  // "S means both 'Fly back' and 'Snapshot'", one line each; empty: none. What is named here does
  // not act.
  QStringList Conflicts() const;

 private:
  void Read(const QByteArray& json, const std::string& path, int depth);
  bool IsUnique(const Command& command, const QKeySequence& key) const;

  QString name_;
  std::map<std::string, QList<QKeySequence>, std::less<>> keys_;
  std::map<MouseGesture, std::vector<MouseBinding>> mouse_;
};

}  // namespace retint
