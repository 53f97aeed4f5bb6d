// SPDX-License-Identifier: BSD-3-Clause
// The parts of the window that its files, exports and panels work with.
#pragma once

namespace retint {

class Canvas;
class CurrentRegion;
class Dialogs;
class PhotoLoader;
class SceneController;
class SelectionMode;
class SessionStore;
class StrokePreview;
class Uncertainty;
class VideoMaker;

// They live as long as the window.
struct WindowParts {
  SceneController* controller;
  SessionStore* sessions;
  CurrentRegion* current;
  SelectionMode* selection;
  Canvas* canvas;
  PhotoLoader* photos;
  Uncertainty* uncertainty;
  StrokePreview* preview;
  VideoMaker* videos;
  Dialogs* dialogs;
};

}  // namespace retint
