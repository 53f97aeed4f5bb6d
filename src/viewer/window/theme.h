// SPDX-License-Identifier: BSD-3-Clause
// Dark and light: as the desktop says, or as the user wants.
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

 Q_SIGNALS:
  void changed();

 private Q_SLOTS:
  void OnSetting(const QString& space, const QString& key, const QDBusVariant& value);

 private:
  void SetSystemScheme(unsigned scheme);
  void Apply();

  ThemeChoice choice_ = ThemeChoice::kSystem;
  bool system_dark_ = false;
};

}  // namespace retint
