// SPDX-License-Identifier: BSD-3-Clause
// The parts of the window that its files and exports work with.
#pragma once

namespace retint {

class Canvas;
class CurrentRegion;
class Dialogs;
class SceneController;
class SelectionMode;
class SessionStore;
class VideoMaker;

// They live as long as the window.
struct WindowParts {
  SceneController* controller;
  SessionStore* sessions;
  CurrentRegion* current;
  SelectionMode* selection;
  Canvas* canvas;
  VideoMaker* videos;
  Dialogs* dialogs;
};

}  // namespace retint
