// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/loss_plot.h"

#include <algorithm>
#include <cmath>

#include <QPainter>
#include <QPainterPath>

namespace retint {
namespace {

QString Short(double value) { return QString::number(value, 'g', 3); }

}  // namespace

LossPlot::LossPlot(QWidget* parent) : QWidget(parent) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setAccessibleName(tr("Loss over steps"));
  setToolTip(tr("The loss of the current region, step by step; lower is better"));
}

void LossPlot::SetLosses(std::vector<double> losses, int per_point) {
  losses_ = std::move(losses);
  per_point_ = std::max(1, per_point);
  setAccessibleDescription(losses_.empty() ? QString() : tr("now %1").arg(Short(losses_.back())));
  update();
}

void LossPlot::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  const QPalette& colors = palette();
  painter.fillRect(rect(), colors.color(QPalette::Base));
  painter.setPen(colors.color(QPalette::Mid));
  painter.drawRect(rect().adjusted(0, 0, -1, -1));
  std::vector<double> finite;
  std::copy_if(losses_.begin(), losses_.end(), std::back_inserter(finite),
               [](double loss) { return std::isfinite(loss); });
  painter.setPen(colors.color(QPalette::Text));
  if (finite.empty()) {
    painter.drawText(rect(), Qt::AlignCenter, tr("no loss yet"));
    return;
  }
  const auto [least, most] = std::minmax_element(finite.begin(), finite.end());
  const QFontMetrics metrics(font());
  const int text = std::max(
      {metrics.horizontalAdvance(Short(*most)), metrics.horizontalAdvance(Short(*least)), 24});
  const QRectF area = QRectF(rect()).adjusted(text + 12, 8, -10, -metrics.height() - 8);
  // From 0, unless all values are far above it.
  const double low = *least > 0.5 * *most ? *least : 0.0;
  const double span = std::max(*most - low, 1e-30);
  const double last = std::max<double>(1, double(losses_.size()) - 1);
  const auto place = [&](double index, double loss) {
    return QPointF(area.left() + area.width() * index / last,
                   area.bottom() - area.height() * (loss - low) / span);
  };
  painter.setPen(colors.color(QPalette::Mid));
  for (const double share : {0.0, 0.5, 1.0}) {
    const double y = area.bottom() - share * area.height();
    painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y));
  }
  painter.setPen(colors.color(QPalette::Text));
  const auto label = [&](double y, double value) {
    const QRectF box(2, y - metrics.height() / 2.0, text + 6, metrics.height());
    painter.drawText(box, Qt::AlignRight | Qt::AlignVCenter, Short(value));
  };
  label(area.top() + 2, *most);
  label(area.bottom() - 2, low);
  const QRectF below(area.left(), area.bottom() + 4, area.width(), metrics.height());
  painter.drawText(below, Qt::AlignLeft, "0");
  painter.drawText(below, Qt::AlignRight,
                   tr("%1 steps").arg((qsizetype(losses_.size()) - 1) * per_point_));

  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(colors.color(QPalette::Highlight), 2));
  QPainterPath path;
  bool gap = true;
  for (size_t i = 0; i < losses_.size(); ++i) {
    if (!std::isfinite(losses_[i])) {
      gap = true;
      continue;
    }
    const QPointF at = place(double(i), losses_[i]);
    gap ? path.moveTo(at) : path.lineTo(at);
    gap = false;
  }
  painter.drawPath(path);
  if (!gap) {
    painter.setBrush(colors.color(QPalette::Highlight));
    painter.drawEllipse(place(double(losses_.size() - 1), losses_.back()), 3, 3);
  }
}

}  // namespace retint
