// SPDX-License-Identifier: BSD-3-Clause
// The user's choice of a color for paint and masks.
#pragma once

#include <QString>

namespace retint {

constexpr const char* kOverlayNames[] = {"orange", "azure", "magenta", "green"};

// Makes ContrastingColor() return this color in the whole program; "": the first that contrasts.
void PreferOverlayColor(const QString& name);

}  // namespace retint
