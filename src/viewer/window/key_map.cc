// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/key_map.h"

#include <algorithm>

#include <QFile>
#include <nlohmann/json.hpp>

#include "base/error.h"

// A resource of a static library has to be asked for, outside any namespace.
static void LoadResources() { Q_INIT_RESOURCE(viewer); }

namespace retint {
namespace {

constexpr const char* kDefault = "SuperSplat";
constexpr int kDeepest = 8;  // bases of bases: a circle ends here

struct GestureName {
  MouseGesture gesture;
  const char* name;
};
constexpr GestureName kGestures[] = {{MouseGesture::kOrbit, "orbit"},
                                     {MouseGesture::kPan, "pan"},
                                     {MouseGesture::kZoom, "zoom"},
                                     {MouseGesture::kLook, "look"}};

std::optional<MouseBinding> ParseBinding(const QString& text) {
  MouseBinding binding;
  for (const QString& part : text.split(u'+')) {
    if (part == "Shift") {
      binding.modifiers |= Qt::ShiftModifier;
    } else if (part == "Ctrl") {
      binding.modifiers |= Qt::ControlModifier;
    } else if (part == "Alt") {
      binding.modifiers |= Qt::AltModifier;
    } else if (binding.button != Qt::NoButton) {
      return std::nullopt;
    } else if (part == "Left") {
      binding.button = Qt::LeftButton;
    } else if (part == "Middle") {
      binding.button = Qt::MiddleButton;
    } else if (part == "Right") {
      binding.button = Qt::RightButton;
    } else {
      return std::nullopt;
    }
  }
  if (binding.button == Qt::NoButton) return std::nullopt;
  return binding;
}

QString BindingText(const MouseBinding& binding) {
  QString text;
  if (binding.modifiers & Qt::ShiftModifier) text += "Shift+";
  if (binding.modifiers & Qt::ControlModifier) text += "Ctrl+";
  if (binding.modifiers & Qt::AltModifier) text += "Alt+";
  switch (binding.button) {
    case Qt::LeftButton:
      return text + "left drag";
    case Qt::MiddleButton:
      return text + "middle drag";
    default:
      return text + "right drag";
  }
}

QStringList Strings(const nlohmann::json& list, const std::string& what, const std::string& path) {
  if (!list.is_array()) throw InputError(path, what + " is not a list of strings");
  QStringList strings;
  for (const auto& entry : list) {
    if (!entry.is_string()) throw InputError(path, what + " is not a list of strings");
    strings << QString::fromStdString(entry.get<std::string>());
  }
  return strings;
}

bool Meet(KeyContext a, KeyContext b) {
  return a == b || a == KeyContext::kAlways || b == KeyContext::kAlways;
}

QByteArray BuiltInJson(const QString& name) {
  LoadResources();
  QFile file(":/retint/keymaps/" + name.toLower() + ".json");
  return file.open(QIODevice::ReadOnly) ? file.readAll() : QByteArray();
}

}  // namespace

const std::vector<Command>& Commands() {
  using enum KeyContext;
  static const std::vector<Command> commands = {
      {"camera.frame", "Camera", "Frame the selection, else the scene", kExplore, false},
      {"camera.reset", "Camera", "Back to the first view", kExplore, false},
      {"camera.fly_mode", "Camera", "Fly: dragging looks around", kExplore, false},
      {"fly.forward", "Camera", "Fly forward", kExplore, true},
      {"fly.back", "Camera", "Fly back", kExplore, true},
      {"fly.left", "Camera", "Fly left", kExplore, true},
      {"fly.right", "Camera", "Fly right", kExplore, true},
      {"fly.down", "Camera", "Fly down", kExplore, true},
      {"fly.up", "Camera", "Fly up", kExplore, true},
      {"view.next", "Views", "Next training view", kExplore, false},
      {"view.previous", "Views", "Previous training view", kExplore, false},
      {"show.frusta", "Show", "Cameras with their photos", kExplore, false},
      {"show.depth", "Show", "Depth", kExplore, false},
      {"show.split", "Show", "Before and after, side by side", kExplore, false},
      {"show.cloud", "Show", "Points of the paint", kExplore, false},
      {"show.mask", "Show", "Mask: what is selected", kExplore, false},
      {"show.uncertain", "Show", "What paint has not decided, hatched", kExplore, false},
      {"show.look_ahead", "Show", "What a stroke selects, while it is drawn", kAlways, false},
      {"show.photo", "Show", "Photo of this view (hold)", kExplore, true},
      {"show.original", "Show", "Scene before the edits (hold)", kExplore, true},
      {"selection.enter", "Edit", "Select: paint on this view", kExplore, false},
      {"edit.undo", "Edit", "Undo", kExplore, false},
      {"edit.redo", "Edit", "Redo", kExplore, false},
      {"edit.cancel", "Edit", "Back out; stop the current task", kExplore, false},
      {"file.open", "File", "Open a workspace and a splat", kAlways, false},
      {"file.open_session", "File", "Open a session", kAlways, false},
      {"file.save", "File", "Save the session", kAlways, false},
      {"file.save_as", "File", "Save the session as", kAlways, false},
      {"file.export_splat", "File", "Export the splat", kAlways, false},
      {"file.close", "File", "Close the scene", kAlways, false},
      {"file.quit", "File", "Quit", kAlways, false},
      {"panel.regions", "Window", "Go to the Regions panel", kAlways, false},
      {"panel.optimizer", "Window", "Go to the Optimizer panel", kAlways, false},
      {"panel.quality", "Window", "Go to the Quality panel", kAlways, false},
      {"panel.views", "Window", "Go to the Views panel", kAlways, false},
      {"panel.scene", "Window", "Go to the Scene panel", kAlways, false},
      {"panel.selection", "Window", "Go to the Selection panel", kAlways, false},
      {"window.panels", "Window", "Hide or show the panels", kAlways, false},
      {"window.screenshot", "Window", "Save a screenshot", kAlways, false},
      {"window.copy_picture", "Window", "Copy the picture", kExplore, false},
      {"window.full_screen", "Window", "Full screen", kAlways, false},
      {"help.keys", "Window", "List of keys", kAlways, false},
  };
  return commands;
}

const Command* FindCommand(std::string_view id) {
  for (const Command& command : Commands()) {
    if (command.id == id) return &command;
  }
  return nullptr;
}

QStringList KeyMap::BuiltIn() { return {"SuperSplat", "LichtFeld", "Blender"}; }

KeyMap KeyMap::Named(const QString& name) {
  const QString known = BuiltIn().contains(name) ? name : QString(kDefault);
  return FromJson(BuiltInJson(known), known.toStdString());
}

KeyMap KeyMap::FromJson(const QByteArray& json, const std::string& path) {
  KeyMap map;
  map.Read(json, path, 0);
  return map;
}

void KeyMap::Read(const QByteArray& json, const std::string& path, int depth) {
  if (depth > kDeepest) throw InputError(path, "its base leads back to itself");
  const auto root = nlohmann::json::parse(json.begin(), json.end(), nullptr, false);
  if (!root.is_object()) throw InputError(path, "is not a JSON object");
  if (!root.contains("name") || !root["name"].is_string()) throw InputError(path, "has no name");
  if (root.contains("base")) {
    const QString base =
        root["base"].is_string() ? QString::fromStdString(root["base"].get<std::string>()) : "";
    if (!BuiltIn().contains(base)) {
      throw InputError(path,
                       "has an unknown base; known are " + BuiltIn().join(", ").toStdString());
    }
    Read(BuiltInJson(base), base.toStdString(), depth + 1);
  }
  name_ = QString::fromStdString(root["name"].get<std::string>());
  const auto keys = root.value("keys", nlohmann::json::object());
  const auto mouse = root.value("mouse", nlohmann::json::object());
  if (!keys.is_object() || !mouse.is_object()) {
    throw InputError(path, "'keys' and 'mouse' must be JSON objects");
  }
  for (const auto& [id, list] : keys.items()) {
    if (!FindCommand(id)) throw InputError(path, "there is no command '" + id + "'");
    QList<QKeySequence> sequences;
    for (const QString& text : Strings(list, "keys." + id, path)) {
      const QKeySequence sequence(text, QKeySequence::PortableText);
      if (sequence.count() != 1 || sequence[0].key() == Qt::Key_unknown) {
        throw InputError(path, "'" + text.toStdString() + "' of " + id + " is no key");
      }
      sequences << sequence;
    }
    keys_[id] = sequences;
  }
  for (const auto& [id, list] : mouse.items()) {
    const auto* known = std::find_if(std::begin(kGestures), std::end(kGestures),
                                     [&id = id](const GestureName& g) { return id == g.name; });
    if (known == std::end(kGestures)) {
      throw InputError(path, "there is no mouse gesture '" + id + "'");
    }
    std::vector<MouseBinding> bindings;
    for (const QString& text : Strings(list, "mouse." + id, path)) {
      const auto binding = ParseBinding(text);
      if (!binding) {
        throw InputError(path, "'" + text.toStdString() + "' of " + id + " is no mouse button");
      }
      bindings.push_back(*binding);
    }
    mouse_[known->gesture] = bindings;
  }
}

QList<QKeySequence> KeyMap::Keys(std::string_view command) const {
  const auto found = keys_.find(command);
  return found == keys_.end() ? QList<QKeySequence>() : found->second;
}

bool KeyMap::IsUnique(const Command& command, const QKeySequence& key) const {
  for (const Command& other : Commands()) {
    if (&other != &command && Meet(command.context, other.context) &&
        Keys(other.id).contains(key)) {
      return false;
    }
  }
  return true;
}

QList<QKeySequence> KeyMap::ActiveKeys(std::string_view id) const {
  const Command* command = FindCommand(id);
  QList<QKeySequence> active;
  for (const QKeySequence& key : Keys(id)) {
    if (command && IsUnique(*command, key)) active << key;
  }
  return active;
}

QString KeyMap::KeyText(std::string_view command) const {
  QStringList texts;
  for (const QKeySequence& key : Keys(command)) texts << key.toString(QKeySequence::NativeText);
  return texts.join(", ");
}

QString KeyMap::MouseText(MouseGesture gesture) const {
  QStringList texts;
  const auto found = mouse_.find(gesture);
  if (found == mouse_.end()) return {};
  for (const MouseBinding& binding : found->second) texts << BindingText(binding);
  return texts.join(", ");
}

std::optional<MouseGesture> KeyMap::Gesture(Qt::MouseButton button,
                                            Qt::KeyboardModifiers modifiers) const {
  const MouseBinding wanted{
      button, modifiers & (Qt::ShiftModifier | Qt::ControlModifier | Qt::AltModifier)};
  std::optional<MouseGesture> found;
  for (const auto& [gesture, bindings] : mouse_) {
    if (std::find(bindings.begin(), bindings.end(), wanted) == bindings.end()) continue;
    if (found) return std::nullopt;  // a conflict
    found = gesture;
  }
  return found;
}

const Command* KeyMap::Held(int key, Qt::KeyboardModifiers modifiers) const {
  if (modifiers & (Qt::ControlModifier | Qt::MetaModifier)) return nullptr;
  for (const auto& [id, sequences] : keys_) {
    const Command* command = FindCommand(id);
    if (!command->held) continue;
    for (const QKeySequence& sequence : sequences) {
      if (sequence[0].key() == key && IsUnique(*command, sequence)) return command;
    }
  }
  return nullptr;
}

bool KeyMap::IsShortcut(QKeyCombination key) const {
  for (const Command& command : Commands()) {
    if (!command.held && Keys(command.id).contains(QKeySequence(key))) return true;
  }
  return false;
}

QStringList KeyMap::Conflicts() const {
  QStringList conflicts;
  const auto& commands = Commands();
  for (size_t i = 0; i < commands.size(); ++i) {
    for (size_t j = i + 1; j < commands.size(); ++j) {
      if (!Meet(commands[i].context, commands[j].context)) continue;
      for (const QKeySequence& key : Keys(commands[i].id)) {
        if (!Keys(commands[j].id).contains(key)) continue;
        conflicts << QStringLiteral("%1 means both \"%2\" and \"%3\"")
                         .arg(key.toString(QKeySequence::NativeText), commands[i].title,
                              commands[j].title);
      }
    }
  }
  for (auto a = mouse_.begin(); a != mouse_.end(); ++a) {
    for (auto b = std::next(a); b != mouse_.end(); ++b) {
      for (const MouseBinding& binding : a->second) {
        if (std::find(b->second.begin(), b->second.end(), binding) == b->second.end()) continue;
        conflicts
            << QStringLiteral("%1 means two ways of moving the camera").arg(BindingText(binding));
      }
    }
  }
  return conflicts;
}

}  // namespace retint
