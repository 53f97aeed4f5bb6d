// SPDX-License-Identifier: BSD-3-Clause
// Small plots as SVG elements, for the page of a report.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace retint {

// `text` as it may stand in HTML, between tags and in an attribute's quotes. Bytes that are not
// UTF-8 become U+FFFD.
std::string HtmlText(std::string_view text);

// A bar for each value, in order, with its label as a tooltip; marked bars are those of a second
// kind, which `mark` names. Values that are not finite are left out. `label` says what is shown.
struct Bar {
  std::string name;
  double value = 0;
  bool marked = false;
};
std::string BarPlot(const std::vector<Bar>& bars, std::string_view unit, std::string_view label,
                    std::string_view mark);

// A line through positive values on a logarithmic axis; empty for fewer than two of them.
std::string LogLinePlot(const std::vector<double>& values, std::string_view x_name,
                        std::string_view label);

}  // namespace retint
