// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/guide.h"

#include <QCoreApplication>
#include <QDialog>
#include <QFile>
#include <QRegularExpression>
#include <QTextBlock>
#include <QTextBrowser>
#include <QVBoxLayout>

// Qt requires this for resources of a static library, outside any namespace.
static void LoadGuide() { Q_INIT_RESOURCE(guide); }

namespace retint {
namespace {

QString Tr(const char* text) { return QCoreApplication::translate("Guide", text); }

QString GuideText() {
  LoadGuide();
  QFile file(":/retint/viewer.md");
  return file.open(QIODevice::ReadOnly) ? QString::fromUtf8(file.readAll()) : QString();
}

// Without pictures and links: the guide has no other pages.
QString Readable(QString text) {
  static const QRegularExpression kPicture("!\\[[^\\]]*\\]\\([^)]*\\)"),
      kLink("\\[([^\\]]*)\\]\\([^)]*\\)");
  return text.remove(kPicture).replace(kLink, "\\1");
}

void GoTo(QTextBrowser* page, const QString& section) {
  for (QTextBlock block = page->document()->begin(); block.isValid(); block = block.next()) {
    if (block.blockFormat().headingLevel() == 0 || block.text() != section) continue;
    page->moveCursor(QTextCursor::End);  // scrolls the heading to the top
    page->setTextCursor(QTextCursor(block));
    return;
  }
}

void ShowGuide(QWidget* from, const QString& section) {
  auto* dialog = new QDialog(from->window());
  dialog->setObjectName("guide");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setWindowTitle(Tr("Guide"));
  auto* page = new QTextBrowser;
  page->setObjectName("guide_page");
  page->setOpenLinks(false);
  page->setMarkdown(Readable(GuideText()));
  auto* layout = new QVBoxLayout(dialog);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(page);
  constexpr QSize kSize(640, 560);
  dialog->resize(kSize);
  dialog->show();
  GoTo(page, section);
}

}  // namespace

QToolButton* MakeGuideButton(const QString& section) {
  auto* button = new QToolButton;
  button->setObjectName("guide_button");
  button->setText(QStringLiteral("?"));
  button->setToolTip(Tr("Open the guide at “%1”").arg(section));
  button->setAccessibleName(button->toolTip());
  button->setFocusPolicy(Qt::StrongFocus);
  button->setAutoRaise(true);
  QObject::connect(button, &QToolButton::clicked, button,
                   [button, section] { ShowGuide(button, section); });
  return button;
}

QStringList GuideSections() {
  QStringList sections;
  for (const QString& line : GuideText().split('\n')) {
    if (line.startsWith("## ")) sections << line.mid(3).trimmed();
  }
  return sections;
}

}  // namespace retint
