// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/picture_edit.h"

namespace retint {

bool EditedPicture::operator==(const EditedPicture& other) const {
  return view == other.view && file == other.file && image.width == other.image.width &&
         image.data == other.image.data && compared == other.compared &&
         before.data == other.before.data && written.data == other.written.data;
}

bool PaintLayer::operator==(const PaintLayer& other) const {
  return view == other.view && x == other.x && y == other.y && color.width == other.color.width &&
         color.data == other.color.data && alpha.data == other.alpha.data;
}

size_t PictureEdit::Bytes() const {
  size_t bytes = 0;
  for (const EditedPicture& picture : pictures) {
    bytes += picture.image.data.size() + picture.before.data.size() + picture.written.data.size();
  }
  for (const PaintLayer& layer : layers) bytes += layer.color.data.size() + layer.alpha.data.size();
  return bytes;
}

}  // namespace retint
