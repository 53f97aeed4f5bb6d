// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/match_report.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/run_clock.h"
#include "recolor/edit_text.h"
#include "reporting/report_plots.h"

namespace retint {
namespace {

using Json = nlohmann::ordered_json;

Json Stops(const Eigen::Vector3d& stops) { return {stops[0], stops[1], stops[2]}; }

}  // namespace

std::string ToJson(const SceneMatch& match) {
  const ColorMatch& colors = match.colors;
  Json trials, views = Json::array();
  for (const MatchTrial& trial : colors.trials) trials[NameOf(trial.map)] = trial.error;
  for (const ViewMatch& view : colors.views) {
    views.push_back({{"view", view.name},
                     {"heldout", view.heldout},
                     {"stops", Stops(view.stops)},
                     {"before", view.before},
                     {"after", view.after}});
  }
  Json json = {{"version", Version()},
               {"map", NameOf(colors.map)},
               {"sentences", match.sentences},
               {"gray_stops", Stops(colors.gray_stops)},
               {"before", colors.before},
               {"after", colors.after},
               {"trials", trials},
               {"heldout_views", colors.heldout},
               {"exposures_differ", colors.exposures_differ},
               {"exposure_spread", colors.spread},
               {"edit", Json::parse(EditToJson(colors.edit, /*with_tables=*/true))},
               {"views", views}};
  if (match.checker) {
    json["checker"] = {{"before", match.checker->before}, {"after", match.checker->after}};
  }
  // Names of views are bytes of a file; ones that are not UTF-8 must not end a finished run.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string WithMatch(const std::string& report, const std::string& region,
                      const SceneMatch& match) {
  Json json = Json::parse(report);
  for (Json& one : json["regions"]) {
    if (one["name"] == region) one["match"] = Json::parse(ToJson(match));
  }
  return json.dump(2) + "\n";
}

std::vector<std::string> LinesOf(const SceneMatch& match) {
  const ColorMatch& colors = match.colors;
  const std::string of = colors.heldout > 0 ? fmt::format("{} held-out views", colors.heldout)
                                            : "the views that were fitted";
  std::vector<std::string> lines = match.sentences;
  lines.push_back(fmt::format("DeltaE00     {:.2f} before, {:.2f} after, in {}", colors.before,
                              colors.after, of));
  std::string trials;
  for (const MatchTrial& trial : colors.trials) {
    trials +=
        fmt::format("{}{} {:.2f}", trials.empty() ? "" : ", ", NameOf(trial.map), trial.error);
  }
  lines.push_back("maps         " + trials);
  if (match.checker) {
    lines.push_back(fmt::format("checker      DeltaE00 {:.2f} before, {:.2f} after",
                                match.checker->before, match.checker->after));
  }
  return lines;
}

HtmlContent PageOf(const SceneMatch& match) {
  const ColorMatch& colors = match.colors;
  HtmlContent page;
  page.sentences = match.sentences;
  const char* const of = colors.heldout > 0 ? "held-out views" : "fitted views";
  page.figures = {{fmt::format("DeltaE00 before, {}", of), fmt::format("{:.2f}", colors.before)},
                  {fmt::format("DeltaE00 after, {}", of), fmt::format("{:.2f}", colors.after)},
                  {"map", std::string(NameOf(colors.map))},
                  {"exposures differ by", fmt::format("{:.2f} stops", colors.spread)}};
  std::vector<Bar> errors;
  for (const ViewMatch& view : colors.views) {
    errors.push_back({view.name, view.after, view.heldout});
    page.captions[view.name] =
        fmt::format("DeltaE00 {:.2f} before, {:.2f} after; {:+.2f} stops beside the other views",
                    view.before, view.after, view.stops.mean());
  }
  page.plots =
      "<h2>DeltaE00 after, by view</h2>\n" +
      BarPlot(errors, "", "DeltaE00 after the match, a bar for each view", "held out") +
      "<h2>Maps</h2>\n<table>\n<tr><th scope=\"col\">map</th><th scope=\"col\">DeltaE00, " + of +
      "</th></tr>\n";
  for (const MatchTrial& trial : colors.trials) {
    page.plots +=
        fmt::format("<tr><td>{}</td><td>{:.2f}</td></tr>\n", NameOf(trial.map), trial.error);
  }
  page.plots += "</table>\n";
  return page;
}

}  // namespace retint
