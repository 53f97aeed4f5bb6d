// SPDX-License-Identifier: BSD-3-Clause
// The editor's guide (docs/viewer.md), which the program carries along.
#pragma once

#include <QToolButton>

namespace retint {

// A "?" that opens the guide where it has the heading `section`.
QToolButton* MakeGuideButton(const QString& section);

// Every heading of the guide.
QStringList GuideSections();

}  // namespace retint
