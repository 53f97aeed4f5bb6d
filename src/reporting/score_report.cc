// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/score_report.h"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace retint {
namespace {

using Json = nlohmann::ordered_json;

struct FigureType {
  const char* name;
  bool more_is_better;
  std::optional<double> (*get)(const ViewScore&);
};

constexpr std::array<FigureType, 8> kFigures = {{
    {"iou", true, [](const ViewScore& v) { return v.mask.iou; }},
    {"boundary_iou", true, [](const ViewScore& v) { return v.mask.boundary_iou; }},
    {"precision", true, [](const ViewScore& v) { return v.mask.precision; }},
    {"recall", true, [](const ViewScore& v) { return v.mask.recall; }},
    {"hit", true, [](const ViewScore& v) { return v.edit.hit; }},
    {"missed", false, [](const ViewScore& v) { return v.edit.missed; }},
    {"leak", false, [](const ViewScore& v) { return v.edit.leak; }},
    {"stained", false, [](const ViewScore& v) { return v.edit.stained; }},
}};

struct Named {
  double value;
  std::string name;
};

ScoreFigure Summarize(const FigureType& type, std::vector<Named> values) {
  ScoreFigure figure;
  figure.name = type.name;
  figure.count = int(values.size());
  // Worst first.
  std::stable_sort(values.begin(), values.end(), [&](const Named& a, const Named& b) {
    return type.more_is_better ? a.value < b.value : a.value > b.value;
  });
  for (const Named& one : values) figure.mean += one.value / double(values.size());
  const size_t half = values.size() / 2;
  figure.median = values.size() % 2 == 1 ? values[half].value
                                         : 0.5 * (values[half - 1].value + values[half].value);
  figure.worst = values[0].value;
  figure.worst_view = values[0].name;
  return figure;
}

ScoreGroup Group(const std::string& name, const std::vector<ViewScore>& views,
                 const std::function<bool(const ViewScore&)>& belongs) {
  ScoreGroup group;
  group.name = name;
  for (const FigureType& type : kFigures) {
    std::vector<Named> values;
    for (const ViewScore& view : views) {
      const auto value = type.get(view);
      if (belongs(view) && value) values.push_back({*value, view.view});
    }
    if (!values.empty()) group.figures.push_back(Summarize(type, std::move(values)));
  }
  for (const ViewScore& view : views) group.views += belongs(view);
  return group;
}

std::string Row(const std::string& name, const std::vector<std::optional<double>>& values) {
  std::string line = fmt::format("{:<28}", name);
  for (const auto& value : values) {
    line += value ? fmt::format(" {:>12.4f}", *value) : fmt::format(" {:>12}", "-");
  }
  return line;
}

}  // namespace

std::vector<ScoreGroup> GroupScores(const ScoreRequest& request,
                                    const std::vector<ViewScore>& views) {
  std::vector<ScoreGroup> groups;
  groups.push_back(Group("all", views, [](const ViewScore& v) { return !v.painted; }));
  if (std::any_of(views.begin(), views.end(),
                  [](const ViewScore& v) { return v.degrees.has_value(); })) {
    groups.push_back(Group(fmt::format("within {:g} degrees", request.within_degrees), views,
                           [&](const ViewScore& v) {
                             return !v.painted && v.degrees && *v.degrees <= request.within_degrees;
                           }));
  }
  return groups;
}

std::string ToJson(const ScoreReport& report) {
  Json views = Json::array();
  for (const ViewScore& view : report.views) {
    Json json = {{"view", view.view}, {"painted", view.painted}};
    if (view.degrees) json["degrees"] = *view.degrees;
    for (const FigureType& type : kFigures) {
      if (const auto value = type.get(view)) json[type.name] = *value;
    }
    views.push_back(std::move(json));
  }
  Json groups = Json::array();
  for (const ScoreGroup& group : report.groups) {
    Json json = {{"name", group.name}, {"views", group.views}};
    for (const ScoreFigure& figure : group.figures) {
      json[figure.name] = {{"count", figure.count},
                           {"mean", figure.mean},
                           {"median", figure.median},
                           {"worst", figure.worst},
                           {"worst_view", figure.worst_view}};
    }
    groups.push_back(std::move(json));
  }
  // Names of files are bytes; those that are no UTF-8 are replaced.
  return Json({{"groups", groups}, {"views", views}})
             .dump(2, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

std::vector<std::string> ToLines(const ScoreReport& report) {
  std::vector<const FigureType*> shown;
  for (const FigureType& type : kFigures) {
    const auto has = [&](const ViewScore& view) { return type.get(view).has_value(); };
    if (std::any_of(report.views.begin(), report.views.end(), has)) shown.push_back(&type);
  }
  std::vector<std::string> lines = {fmt::format("{:<28}", "view")};
  for (const FigureType* type : shown) lines.back() += fmt::format(" {:>12}", type->name);
  for (const ViewScore& view : report.views) {
    std::vector<std::optional<double>> values;
    for (const FigureType* type : shown) values.push_back(type->get(view));
    lines.push_back(Row(view.view + (view.painted ? " (given)" : ""), values));
  }
  for (const ScoreGroup& group : report.groups) {
    lines.emplace_back();
    lines.push_back(fmt::format("{}, {} views", group.name, group.views));
    const std::array<std::pair<const char*, double ScoreFigure::*>, 3> rows = {
        {{"  mean", &ScoreFigure::mean},
         {"  median", &ScoreFigure::median},
         {"  worst", &ScoreFigure::worst}}};
    for (const auto& [name, member] : rows) {
      std::vector<std::optional<double>> values;
      for (const FigureType* type : shown) {
        values.emplace_back();
        for (const ScoreFigure& figure : group.figures) {
          if (figure.name == type->name) values.back() = figure.*member;
        }
      }
      lines.push_back(Row(name, values));
    }
  }
  return lines;
}

}  // namespace retint
