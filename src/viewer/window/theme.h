// SPDX-License-Identifier: BSD-3-Clause
// Dark or light: from the desktop's palette or the user's choice. Black and white if the desktop's
// palette is.
#pragma once

#include <QObject>
#include <QString>

namespace retint {

enum class ThemeChoice { kSystem, kLight, kDark };

// "system", "light", "dark"; anything else: kSystem.
ThemeChoice ParseTheme(const QString& name);
QString ThemeName(ThemeChoice choice);

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

 private:
  void Apply();

  ThemeChoice choice_ = ThemeChoice::kSystem;
  bool system_dark_ = false, high_contrast_ = false;
};

}  // namespace retint
