// SPDX-License-Identifier: BSD-3-Clause
// Scenes and sessions that were open, in the user's settings, and a small picture of each.
#pragma once

#include <QDateTime>
#include <QImage>
#include <QString>
#include <QStringList>

#include "viewer/scene/scene_controller.h"

namespace retint {

// An entry is the path of a session, or a scene's files and how they are opened.
QString RecentEntry(const OpenRequest& request);
OpenRequest RecentRequest(const QString& entry);  // of a scene
bool IsSessionEntry(const QString& entry);
QString RecentTitle(const QString& entry);  // its paths
QString RecentName(const QString& entry);   // short
// A file that it needs and that is gone; empty: it can be opened.
QString MissingOf(const QString& entry);

QStringList RecentFiles();  // the newest first
void RememberRecent(const QString& entry);
void ForgetRecent(const QString& entry);
void ForgetRecentFiles();

// Null without one. The time is that of its picture.
QImage RecentPicture(const QString& entry);
QDateTime RecentTime(const QString& entry);
void KeepRecentPicture(const QString& entry, const QImage& picture);

}  // namespace retint
