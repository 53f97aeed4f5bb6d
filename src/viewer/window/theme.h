// SPDX-License-Identifier: BSD-3-Clause
// Dark and light: as the desktop says, or as the user wants; in black and white where the desktop
// asks for high contrast.
#pragma once

#include <QObject>
#include <QString>

class QDBusVariant;

namespace retint {

enum class ThemeChoice { kSystem, kLight, kDark };

// "system", "light", "dark"; anything else: kSystem.
ThemeChoice ParseTheme(const QString& name);
QString ThemeName(ThemeChoice choice);

// Follows the desktop: its portal (org.freedesktop.appearance) where there is one, else the palette
// that the platform gave the application.
class Theme : public QObject {
  Q_OBJECT

 public:
  explicit Theme(QObject* parent = nullptr);
  void Choose(ThemeChoice choice);
  ThemeChoice choice() const { return choice_; }
  bool dark() const;
  bool high_contrast() const { return high_contrast_; }

 Q_SIGNALS:
  void changed();

 private Q_SLOTS:
  // Of the portal: a setting as it is at first, and one that changed.
  void OnAnswer(const QString& key, unsigned value);
  void OnSetting(const QString& space, const QString& key, const QDBusVariant& value);

 private:
  void Take(const QString& key, unsigned value);  // of the portal
  void Apply();

  ThemeChoice choice_ = ThemeChoice::kSystem;
  bool system_dark_ = false, high_contrast_ = false;
};

}  // namespace retint
