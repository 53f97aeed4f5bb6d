// SPDX-License-Identifier: BSD-3-Clause
// The page without an open scene: the sample, a place to drop files, and recent files.
#pragma once

#include <QLabel>
#include <QScrollArea>
#include <QString>
#include <QStringList>

class QGridLayout;

namespace retint {

class StartPage : public QScrollArea {
  Q_OBJECT

 public:
  StartPage();

  void Show(const QStringList& recent);  // entries of recent_files.h
  void SetTask(const QString& task);     // the scene that is being opened; empty: none

 Q_SIGNALS:
  void openRequested();
  void sampleRequested();
  void recentRequested(const QString& entry);
  void forgetRequested(const QString& entry);

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  void Arrange();

  QLabel* title_;
  QWidget* choices_;
  QWidget* recent_;
  QGridLayout* cards_;
};

}  // namespace retint
