// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/icon.h"

#include <utility>

#include <QBuffer>
#include <QFile>
#include <QImageReader>
#include <QPixmap>

// Qt requires this for resources of a static library, outside any namespace.
static void LoadResources() { Q_INIT_RESOURCE(icons); }

namespace retint {

QIcon MakeIcon(const char* name, const QPalette& palette) {
  LoadResources();
  QFile file(QString(":/retint/icons/%1.svg").arg(name));
  if (!file.open(QIODevice::ReadOnly)) return {};
  const QByteArray drawing = file.readAll();
  QIcon icon;
  for (const auto& [mode, group] : {std::pair{QIcon::Normal, QPalette::Active},
                                    std::pair{QIcon::Disabled, QPalette::Disabled}}) {
    QByteArray tinted = drawing;
    tinted.replace("currentColor", palette.color(group, QPalette::ButtonText).name().toLatin1());
    for (const int size : {20, 40, 60}) {  // for screens at 100, 200 and 300 %
      QBuffer buffer(&tinted);
      QImageReader reader(&buffer, "svg");
      reader.setScaledSize({size, size});
      icon.addPixmap(QPixmap::fromImage(reader.read()), mode);
    }
  }
  return icon;
}

}  // namespace retint
