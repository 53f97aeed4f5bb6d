// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/report_plots.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

namespace retint {
namespace {

constexpr double kWidth = 720, kHeight = 220, kLeft = 48, kBottom = 24, kTop = 10;
constexpr double kPlotWidth = kWidth - kLeft - 8, kPlotHeight = kHeight - kTop - kBottom;

// The length of the UTF-8 sequence that begins at text[i]; 0 if there is no valid one.
size_t Utf8Length(std::string_view text, size_t i) {
  const auto lead = static_cast<unsigned char>(text[i]);
  const size_t length = lead < 0x80                    ? 1
                        : lead >= 0xC2 && lead < 0xE0  ? 2
                        : lead >= 0xE0 && lead < 0xF0  ? 3
                        : lead >= 0xF0 && lead <= 0xF4 ? 4
                                                       : 0;
  if (length == 0 || i + length > text.size()) return 0;
  for (size_t k = 1; k < length; ++k) {
    if ((static_cast<unsigned char>(text[i + k]) & 0xC0) != 0x80) return 0;
  }
  return length;
}

std::string Opening(std::string_view label) {
  return fmt::format(
      "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\"><title>{}</title>\n", kWidth,
      kHeight, HtmlText(label), HtmlText(label));
}

// A line across with its value on the left.
std::string Tick(double y, const std::string& text) {
  return fmt::format(
      "<line class=\"grid\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>"
      "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
      kLeft, kLeft + kPlotWidth, y, kLeft - 6, y + 4, text);
}

}  // namespace

std::string HtmlText(std::string_view text) {
  std::string html;
  for (size_t i = 0; i < text.size();) {
    const size_t length = Utf8Length(text, i);
    if (length == 0) {
      html += "\xEF\xBF\xBD";
      ++i;
      continue;
    }
    switch (text[i]) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      case '"':
        html += "&quot;";
        break;
      case '\'':
        html += "&#39;";
        break;
      default:
        html += text.substr(i, length);
    }
    i += length;
  }
  return html;
}

std::string BarPlot(const std::vector<Bar>& bars, std::string_view unit, std::string_view label,
                    std::string_view mark) {
  double most = 0;
  for (const Bar& bar : bars) most = std::max(most, std::isfinite(bar.value) ? bar.value : 0);
  if (most <= 0) return "";
  const double step = most > 40 ? 20 : most > 15 ? 10 : most > 4 ? 2 : 1;
  const double top = std::ceil(most / step) * step;
  const auto y_of = [&](double value) { return kTop + kPlotHeight * (1 - value / top); };
  std::string svg = Opening(label);
  for (double value = 0; value <= top; value += step) {
    svg += Tick(y_of(value), fmt::format("{:g}", value));
  }
  const double slot = kPlotWidth / static_cast<double>(bars.size());
  for (size_t i = 0; i < bars.size(); ++i) {
    const Bar& bar = bars[i];
    if (!std::isfinite(bar.value)) continue;
    const double y = y_of(std::max(0.0, bar.value));
    svg += fmt::format(
        "<rect class=\"{}\" x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.1f}\">"
        "<title>{}{}: {:.1f} {}</title></rect>\n",
        bar.marked ? "marked" : "bar", kLeft + slot * (static_cast<double>(i) + 0.1), y, slot * 0.8,
        kTop + kPlotHeight - y, HtmlText(bar.name),
        bar.marked ? " (" + HtmlText(mark) + ")" : std::string(), bar.value, HtmlText(unit));
  }
  return svg + "</svg>\n";
}

std::string LogLinePlot(const std::vector<double>& values, std::string_view x_name,
                        std::string_view label) {
  std::vector<std::pair<size_t, double>> points;
  for (size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i]) && values[i] > 0) points.emplace_back(i, std::log10(values[i]));
  }
  if (points.size() < 2) return "";
  double least = points[0].second, most = least;
  for (const auto& [i, value] : points) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
  if (most - least < 1e-6) most = least + 1e-6;
  const auto y_of = [&](double value) {
    return kTop + kPlotHeight * (most - value) / (most - least);
  };
  std::string svg = Opening(label);
  for (int k = 0; k <= 3; ++k) {
    const double value = least + (most - least) * k / 3;
    svg += Tick(y_of(value), fmt::format("{:.1e}", std::pow(10, value)));
  }
  svg += "<polyline class=\"line\" points=\"";
  for (const auto& [i, value] : points) {
    const double x = static_cast<double>(i) / static_cast<double>(values.size() - 1);
    svg += fmt::format("{:.1f},{:.1f} ", kLeft + kPlotWidth * x, y_of(value));
  }
  svg += fmt::format("\"/>\n<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>\n</svg>\n",
                     kLeft + kPlotWidth, kHeight - 6, HtmlText(x_name));
  return svg;
}

}  // namespace retint
