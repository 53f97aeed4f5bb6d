// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/key_map.h"

namespace retint {
namespace {

struct Drag {
  MouseGesture gesture;
  Qt::MouseButton button;
  Qt::KeyboardModifiers modifiers;
  const char* text;
};
constexpr Drag kDrags[] = {
    {MouseGesture::kOrbit, Qt::LeftButton, Qt::NoModifier, "left drag"},
    {MouseGesture::kOrbit, Qt::MiddleButton, Qt::NoModifier, "middle drag"},
    {MouseGesture::kPan, Qt::RightButton, Qt::NoModifier, "right drag"},
    {MouseGesture::kPan, Qt::MiddleButton, Qt::ShiftModifier, "Shift+middle drag"},
    {MouseGesture::kPan, Qt::LeftButton, Qt::ShiftModifier, "Shift+left drag"},
    {MouseGesture::kZoom, Qt::MiddleButton, Qt::ControlModifier, "Ctrl+middle drag"},
    {MouseGesture::kZoom, Qt::LeftButton, Qt::ControlModifier, "Ctrl+left drag"},
    {MouseGesture::kLook, Qt::LeftButton, Qt::AltModifier, "Alt+left drag"},
};

}  // namespace

const std::vector<Command>& Commands() {
  using enum KeyContext;
  static const std::vector<Command> commands = {
      {"camera.frame", "Camera", "Frame the selection, else the scene", kExplore, false, "F"},
      {"camera.reset", "Camera", "Back to the first view", kExplore, false, "Shift+F"},
      {"camera.fly_mode", "Camera", "Fly: dragging looks around", kExplore, false, "V"},
      {"fly.forward", "Camera", "Fly forward", kExplore, true, "W"},
      {"fly.back", "Camera", "Fly back", kExplore, true, "S"},
      {"fly.left", "Camera", "Fly left", kExplore, true, "A"},
      {"fly.right", "Camera", "Fly right", kExplore, true, "D"},
      {"fly.down", "Camera", "Fly down", kExplore, true, "Q"},
      {"fly.up", "Camera", "Fly up", kExplore, true, "E"},
      {"view.next", "Views", "Next training view", kExplore, false, "Right"},
      {"view.previous", "Views", "Previous training view", kExplore, false, "Left"},
      {"show.frusta", "Show", "Cameras with their photos", kExplore, false, "C"},
      {"show.depth", "Show", "Depth", kExplore, false, "N"},
      {"show.split", "Show", "Before and after, side by side", kExplore, false, "X"},
      {"show.cloud", "Show", "Points of the paint", kExplore, false, "M"},
      {"show.mask", "Show", "Mask: what is selected", kExplore, false, "Shift+M"},
      {"show.uncertain", "Show", "What paint has not decided, hatched", kExplore, false, "U"},
      {"show.look_ahead", "Show", "What a stroke selects, while it is drawn", kAlways, false,
       "Shift+V"},
      {"show.photo", "Show", "Photo of this view (hold)", kExplore, true, "P"},
      {"show.original", "Show", "Scene before the edits (hold)", kExplore, true, "\\"},
      {"selection.enter", "Edit", "Paint on this view", kExplore, false, "Return, Enter, B"},
      {"edit.undo", "Edit", "Undo", kExplore, false, "Ctrl+Z"},
      {"edit.redo", "Edit", "Redo", kExplore, false, "Ctrl+Shift+Z, Ctrl+Y"},
      {"edit.cancel", "Edit", "Back out; stop the current task", kExplore, false, "Esc"},
      {"file.open", "File", "Open a workspace and a splat", kAlways, false, "Ctrl+O"},
      {"file.open_session", "File", "Open a session", kAlways, false, "Ctrl+Shift+O"},
      {"file.save", "File", "Save the session", kAlways, false, "Ctrl+S"},
      {"file.save_as", "File", "Save the session as", kAlways, false, "Ctrl+Shift+S"},
      {"file.export_splat", "File", "Export the splat", kAlways, false, "Ctrl+E"},
      {"file.close", "File", "Close the scene", kAlways, false, "Ctrl+W"},
      {"file.quit", "File", "Quit", kAlways, false, "Ctrl+Q"},
      {"window.panels", "Window", "Hide or show the panels", kAlways, false, "Tab"},
      {"window.screenshot", "Window", "Save a screenshot", kAlways, false, "F2"},
      {"window.copy_picture", "Window", "Copy the picture", kExplore, false, "Ctrl+Shift+C"},
      {"window.full_screen", "Window", "Full screen", kAlways, false, "F11"},
      {"help.keys", "Window", "List of keys", kAlways, false, "F1"},
  };
  return commands;
}

const Command* FindCommand(std::string_view id) {
  for (const Command& command : Commands()) {
    if (command.id == id) return &command;
  }
  return nullptr;
}

QList<QKeySequence> KeysOf(std::string_view id) {
  const Command* command = FindCommand(id);
  QList<QKeySequence> keys;
  if (!command) return keys;
  for (const QString& text : QString(command->keys).split(", ")) {
    keys << QKeySequence(text, QKeySequence::PortableText);
  }
  return keys;
}

QString KeyText(const QList<QKeySequence>& keys) {
  QStringList texts;
  for (const QKeySequence& key : keys) texts << key.toString(QKeySequence::NativeText);
  return texts.join(", ");
}

QString KeyText(std::string_view command) { return KeyText(KeysOf(command)); }

QString MouseText(MouseGesture gesture) {
  QStringList texts;
  for (const Drag& drag : kDrags) {
    if (drag.gesture == gesture) texts << drag.text;
  }
  return texts.join(", ");
}

std::optional<MouseGesture> GestureOf(Qt::MouseButton button, Qt::KeyboardModifiers modifiers) {
  modifiers &= Qt::ShiftModifier | Qt::ControlModifier | Qt::AltModifier;
  for (const Drag& drag : kDrags) {
    if (drag.button == button && drag.modifiers == modifiers) return drag.gesture;
  }
  return std::nullopt;
}

const Command* HeldCommand(int key, Qt::KeyboardModifiers modifiers) {
  if (modifiers & (Qt::ControlModifier | Qt::MetaModifier)) return nullptr;
  for (const Command& command : Commands()) {
    if (command.held && KeysOf(command.id).contains(QKeySequence(key))) return &command;
  }
  return nullptr;
}

bool IsShortcut(QKeyCombination key) {
  for (const Command& command : Commands()) {
    if (!command.held && KeysOf(command.id).contains(QKeySequence(key))) return true;
  }
  return false;
}

}  // namespace retint
