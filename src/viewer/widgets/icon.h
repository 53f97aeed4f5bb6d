// SPDX-License-Identifier: BSD-3-Clause
// The icons of this folder: 24 x 24, lines 2 wide, drawn in currentColor.
#pragma once

#include <QIcon>
#include <QPalette>

namespace retint {

// NAME.svg in the palette's color of text on buttons, so that it suits light and dark.
QIcon MakeIcon(const char* name, const QPalette& palette);

}  // namespace retint
