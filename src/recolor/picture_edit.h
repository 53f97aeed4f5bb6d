// SPDX-License-Identifier: BSD-3-Clause
// Views that were edited as pictures, in a paint program, and the results for them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/image.h"

namespace retint {

// A picture of a view, to be compared with that view's render or photo.
struct EditedPicture {
  std::string view;  // its name
  std::string file;  // where the picture is; for messages too
  Image8 image;      // empty: it is still to be read from `file`
  // Was resampled from a picture in the pixels of a distorted photo.
  bool of_photo = false;
  // Of one that was handed out to be painted on: the picture without the operation, and with it, as
  // it was written. Empty: it was made from the view's render or photo.
  Image8 before = {}, written = {};
  bool compared = false;  // the result is in the operation's map and layers
  bool operator==(const EditedPicture& other) const;
};

// Paint on a part of a view: the surfaces seen there take it, in all views.
struct PaintLayer {
  std::string view;
  int x = 0, y = 0;  // of its top-left pixel in the view
  Image8 color;
  Mask alpha;  // the same size; 0 in unpainted pixels
  bool operator==(const PaintLayer& other) const;
};

// First the pictures; once they are compared with the scene, the part of their change that one
// color map does not explain, as layers. Pictures that come later are compared without the earlier
// ones, whose layers stay.
struct PictureEdit {
  std::vector<EditedPicture> pictures;
  std::vector<PaintLayer> layers;
  bool selects =
      false;  // the changed pixels are the selection: those next to it were left unchanged
  bool operator==(const PictureEdit&) const = default;
  size_t Bytes() const;
};

}  // namespace retint
