// SPDX-License-Identifier: BSD-3-Clause
// Scenes and sessions that were open, in the user's settings, with a small picture of each.
#pragma once

#include <QDateTime>
#include <QImage>
#include <QString>
#include <QStringList>

#include "viewer/scene/scene_controller.h"

namespace retint {

// An entry is the path of a session, or files of a scene and the options to open them.
QString RecentEntry(const OpenRequest& request);
OpenRequest RecentRequest(const QString& entry);  // of a scene
bool IsSessionEntry(const QString& entry);
QString RecentTitle(const QString& entry);  // its paths
QString RecentName(const QString& entry);   // short
// A missing file that the entry needs; empty: all are there.
QString MissingOf(const QString& entry);

QStringList RecentFiles();  // the newest first
void RememberRecent(const QString& entry);
void ForgetRecent(const QString& entry);
void ForgetRecentFiles();

// The picture, or null. RecentTime() is the time of the picture.
QImage RecentPicture(const QString& entry);
QDateTime RecentTime(const QString& entry);
void KeepRecentPicture(const QString& entry, const QImage& picture);

}  // namespace retint
