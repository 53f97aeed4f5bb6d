// SPDX-License-Identifier: BSD-3-Clause
// The color that the user prefers for what is painted and for masks.
#pragma once

#include <QString>

namespace retint {

constexpr const char* kOverlayNames[] = {"orange", "azure", "magenta", "green"};

// From then on ContrastingColor() is that of this name, of the whole program; "": as it contrasts.
void PreferOverlayColor(const QString& name);

}  // namespace retint
