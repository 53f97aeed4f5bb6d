// SPDX-License-Identifier: BSD-3-Clause
// A row of colors in the settings: the last chosen ones, or those that the user keeps.
#pragma once

#include <vector>

#include <QColor>
#include <QWidget>

class QLabel;
class QToolButton;

namespace retint {

class SwatchRow : public QWidget {
  Q_OBJECT

 public:
  // Recent colors come and go automatically, the newest first. The user adds kept colors at the
  // end, and removes them.
  enum class Form { kRecent, kKept };

  // `key`: the place in the settings.
  SwatchRow(const QString& title, const QString& key, Form form, QWidget* parent = nullptr);
  void Add(const QColor& color);
  const std::vector<QColor>& colors() const { return colors_; }

  static constexpr size_t kMostRecent = 8, kMostKept = 24;

 Q_SIGNALS:
  void chosen(const QColor& color);
  void addWanted();  // the button with a plus

 protected:
  void changeEvent(QEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  QToolButton* AddButton();
  void Build();
  void Show();
  void Remove(size_t index);
  void Save() const;

  const QString key_;
  const Form form_;
  QLabel* title_;
  std::vector<QColor> colors_;
  std::vector<QToolButton*> cells_;  // one for each possible color
  QToolButton* plus_ = nullptr;      // of kKept
};

}  // namespace retint
