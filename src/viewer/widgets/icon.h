// SPDX-License-Identifier: BSD-3-Clause
// The icons of this folder: 24 x 24 pixels, lines 2 wide, drawn in currentColor.
#pragma once

#include <QIcon>
#include <QPalette>

namespace retint {

// NAME.svg in the palette's color for button text, which suits light and dark themes.
QIcon MakeIcon(const char* name, const QPalette& palette);

}  // namespace retint
