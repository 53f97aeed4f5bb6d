// SPDX-License-Identifier: BSD-3-Clause
// The editor's guide (docs/viewer.md), which is part of the program.
#pragma once

#include <QToolButton>

namespace retint {

// A "?" button that opens the guide at the heading `section`.
QToolButton* MakeGuideButton(const QString& section);

// All headings of the guide.
QStringList GuideSections();

}  // namespace retint
