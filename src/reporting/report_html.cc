// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/report_html.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "base/base64.h"
#include "base/error.h"
#include "base/run_clock.h"
#include "colmap_io/image_io.h"
#include "recolor/edit_text.h"
#include "reporting/report_plots.h"
#include "scene/contact_sheet.h"
#include "scene/mask_pixels.h"
#include "selecting/paint_held.h"
#include "selecting/paint_picture.h"

namespace retint {
namespace {

constexpr double kMostPixels = 800 * 600;  // of a picture
constexpr double kLeastPixels = 200 * 150;
constexpr double kBytesPerPixel = 0.25;  // of a JPEG of quality 85, roughly
constexpr int kQualities[] = {85, 70, 50, 30};

constexpr std::string_view kStyle = R"(
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1c1e21; --quiet: #5d6470; --line: #d9dce1;
  --accent: #2457d6; --mark: #b4540a; --warn: #fff3d6; }
@media (prefers-color-scheme: dark) { :root { --paper: #17191c; --ink: #e6e8ea; --quiet: #a3aab4;
  --line: #363b42; --accent: #85a7ff; --mark: #f0a35c; --warn: #40331a; } }
body { margin: 0 auto; max-width: 1180px; padding: 24px; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, sans-serif; }
h1 { font-size: 26px; margin: 0 0 4px; overflow-wrap: anywhere; } h2 { font-size: 19px; margin: 36px 0 10px; }
p, .quiet { color: var(--quiet); margin: 4px 0; }
dl.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(170px, 1fr)); gap: 12px; margin: 20px 0; }
dl.figures div { border: 1px solid var(--line); border-radius: 8px; padding: 10px 14px; }
dl.figures dt { color: var(--quiet); font-size: 13px; } dl.figures dd { margin: 0; font-size: 20px; }
ul.warnings { background: var(--warn); border-radius: 8px; padding: 12px 12px 12px 32px; }
.views, .paints { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 18px; }
figure { margin: 0; } figcaption { font-size: 13px; overflow-wrap: anywhere; }
.paints img { display: block; width: 100%; height: auto; border-radius: 6px; }
.pair { position: relative; border-radius: 6px; overflow: hidden; background: #000; }
.pair img { display: block; width: 100%; height: auto; }
.pair img + img { position: absolute; inset: 0; clip-path: inset(0 0 0 var(--at, 50%)); }
.side { position: absolute; inset: 0; padding: 4px 8px; color: #fff; font-size: 12px; pointer-events: none;
  text-shadow: 0 0 3px #000, 0 0 3px #000; clip-path: inset(0 calc(100% - var(--at, 50%)) 0 0); }
.side + .side { text-align: right; clip-path: inset(0 0 0 var(--at, 50%)); }
.pair img.mask { clip-path: none; display: none; } figure.masked img.mask { display: block; }
figure input { width: 100%; margin: 6px 0 0; accent-color: var(--accent); }
figure button { font: inherit; font-size: 13px; color: var(--ink); background: none; border: 1px solid var(--line);
  border-radius: 6px; padding: 2px 10px; cursor: pointer; }
figure button[aria-pressed=true] { border-color: var(--accent); color: var(--accent); }
.tag { border: 1px solid var(--mark); color: var(--mark); border-radius: 10px; padding: 0 8px; font-size: 12px; }
svg { width: 100%; max-width: 760px; height: auto; } svg text { fill: var(--quiet); font: 11px system-ui, sans-serif; }
.grid { stroke: var(--line); } .bar { fill: var(--accent); } .marked { fill: var(--mark); }
.line { fill: none; stroke: var(--accent); stroke-width: 2; }
table { border-collapse: collapse; font-size: 14px; } th, td { text-align: left; padding: 4px 18px 4px 0;
  border-bottom: 1px solid var(--line); vertical-align: top; overflow-wrap: anywhere; }
pre { background: color-mix(in srgb, var(--line) 40%, transparent); padding: 12px; border-radius: 8px; white-space: pre-wrap;
  overflow-wrap: anywhere; }
)";

constexpr std::string_view kScript = R"(
for (const figure of document.querySelectorAll('.views figure')) {
  const pair = figure.querySelector('.pair'), slider = figure.querySelector('input');
  slider.addEventListener('input', () => pair.style.setProperty('--at', slider.value + '%'));
  const button = figure.querySelector('button');
  if (button) button.addEventListener('click', () => button.setAttribute('aria-pressed',
    figure.classList.toggle('masked')));
}
)";

// In a view: of the region whose PSNR inside is the lowest there.
struct WorstQuality : ViewQuality {
  std::string region;  // empty: there is but one
};

struct ViewPictures {
  const View* view = nullptr;
  bool painted = false, heldout = false;
  const WorstQuality* quality = nullptr;  // null: it holds no masked pixel
  int slider = 50;                        // its first place, percent of the width from the left
  double selected = 0;                    // of its pixels, by any region
  Image8 before, after, mask;             // no mask: empty; of a page with content the photo
};

// The paint of a region in its selection.
struct RegionPaint {
  std::string region, verdict;
  std::vector<PaintedPicture> views;
};

std::map<std::string, WorstQuality> QualityByView(const RunReport& report) {
  std::map<std::string, WorstQuality> views;
  const auto add = [&](const QualityReport& quality, const std::string& region) {
    for (const ViewQuality& view : quality.views) {
      const auto [found, is_new] = views.emplace(view.name, WorstQuality{view, region});
      if (!is_new && view.psnr_inside < found->second.psnr_inside) found->second = {view, region};
    }
  };
  add(report.quality, {});
  const bool several = report.regions.size() > 1;
  for (const RegionReport& one : report.regions) add(one.quality, several ? one.name : "");
  return views;
}

// The union of the visible regions' masks in a view; empty: nothing is selected.
Mask UnionOfMasks(const RegionSet& regions, const std::string& name) {
  Mask all;
  for (const Region& region : regions.regions) {
    const auto mask = region.selection->masks.find(name);
    if (!region.visible || mask == region.selection->masks.end()) continue;
    if (all.Empty()) all = Mask(mask->second.width, mask->second.height);
    for (size_t i = 0; i < all.data.size(); ++i) {
      all.data[i] = std::max(all.data[i], mask->second.data[i]);
    }
  }
  const bool any = std::any_of(all.data.begin(), all.data.end(), [](uint8_t v) { return v > 0; });
  return any ? all : Mask();
}

// The place of a slider that shows most of a change: half of the mask on either side, in percent of
// the width.
int MiddleOf(const Mask& mask) {
  std::vector<size_t> columns(static_cast<size_t>(mask.width));
  size_t all = 0;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    columns[i % columns.size()] += mask.data[i];
    all += mask.data[i];
  }
  size_t left = 0, x = 0;
  while (2 * left < all) left += columns[x++];
  return static_cast<int>(100 * x / columns.size());
}

class Page {
 public:
  Page(EditSession& session, const RunReport& report, const HtmlReportOptions& options)
      : session_(session), report_(report), options_(options), quality_(QualityByView(report)) {}

  void Render(Monitor& monitor);
  std::string Text() const;

 private:
  Image8 Shrunk(const Image8& image) const;
  std::string Pictures(int quality) const;
  std::string Figures() const;
  std::string Warnings() const;
  std::string Paint(int quality) const;
  std::string Plots() const;
  std::string Tables() const;

  EditSession& session_;
  const RunReport& report_;
  const HtmlReportOptions& options_;
  const std::map<std::string, WorstQuality> quality_;
  std::vector<ViewPictures> views_;
  std::vector<RegionPaint> paint_;
};

Image8 Page::Shrunk(const Image8& image) const {
  size_t pictures = 3 * views_.size();
  for (const RegionPaint& one : paint_) pictures += one.views.size();
  const auto count = static_cast<double>(std::max<size_t>(1, pictures));
  const double budget = static_cast<double>(options_.most_bytes) * 0.7 / count;
  const double area = std::clamp(budget / kBytesPerPixel, kLeastPixels, kMostPixels);
  const double shape = static_cast<double>(image.width) / image.height;
  const int width = std::max(16, static_cast<int>(std::sqrt(area * shape)));
  return width >= image.width ? image : ContactSheet({{image}}, width, /*gap=*/0);
}

void Page::Render(Monitor& monitor) {
  const FloatArray after = session_.refits().CurrentSh();
  const auto& heldout = session_.scene().heldout_views();
  for (const View* view : session_.scene().views()) {
    ViewPictures one;
    one.view = view;
    one.heldout = std::find(heldout.begin(), heldout.end(), view) != heldout.end();
    one.painted = std::any_of(report_.painted.begin(), report_.painted.end(),
                              [&](const auto& painted) { return painted.view == view->name; });
    const auto quality = quality_.find(view->name);
    if (quality != quality_.end()) one.quality = &quality->second;
    views_.push_back(std::move(one));
  }
  std::stable_sort(views_.begin(), views_.end(), [](const auto& a, const auto& b) {
    if (!a.quality || !b.quality) return a.quality && !b.quality;
    return a.quality->psnr_inside < b.quality->psnr_inside;
  });
  const RegionSet regions = session_.store().regions();
  for (const Region& region : regions.regions) {
    const RegionSelection& selection = *region.selection;
    if (!region.visible || selection.source.painted.empty()) continue;
    const Workspace& workspace = session_.scene().workspace();
    paint_.push_back(
        {region.name, VerdictOfPaint(workspace, selection.source.painted, selection.masks),
         PicturesOfPaint(session_.scene(), selection.source.painted, selection.masks)});
  }
  for (RegionPaint& one : paint_) {
    for (PaintedPicture& view : one.views) view.picture = Shrunk(view.picture);
  }
  const double steps = 2 * static_cast<double>(views_.size());
  double done = 0;
  for (const bool edited : {true, false}) {
    session_.scene().renderer().SetSh(edited ? std::span<const float>(after)
                                             : session_.scene().original().sh);
    for (ViewPictures& one : views_) {
      monitor.Step("pictures", done++, steps);
      const PosedCamera camera = session_.scene().reconstruction().Posed(*one.view);
      const Image picture = session_.scene().renderer().Render(camera).rgb;
      (edited ? one.after : one.before) = Shrunk(ToImage8(picture));
      if (edited) continue;
      if (options_.content) {
        const Workspace& workspace = session_.scene().workspace();
        if (workspace.HasPhoto(*one.view))
          one.mask = Shrunk(ToImage8(workspace.ReadPhoto(*one.view)));
        continue;
      }
      const Mask mask = UnionOfMasks(regions, one.view->name);
      if (mask.Empty()) continue;
      one.mask = Shrunk(MaskOverlay(picture, mask));
      one.selected = FractionInside(mask);
      one.slider = MiddleOf(mask);
    }
  }
}

std::string Embedded(const Image8& image, int quality) {
  return "data:image/jpeg;base64," + EncodeBase64(EncodeJpeg(image, quality));
}

std::string Page::Pictures(int quality) const {
  const char* const shown = options_.content ? "photo" : "mask";
  std::string html = "<div class=\"views\">\n";
  for (const ViewPictures& one : views_) {
    const std::string name = HtmlText(one.view->name);
    html += fmt::format(
        "<figure><div class=\"pair\" style=\"--at: {5}%\"><img loading=\"lazy\" width=\"{0}\" "
        "height=\"{1}\" "
        "alt=\"{2} before\" src=\"{3}\"><img loading=\"lazy\" width=\"{0}\" height=\"{1}\" "
        "alt=\"{2} after\" src=\"{4}\">",
        one.before.width, one.before.height, name, Embedded(one.before, quality),
        Embedded(one.after, quality), one.slider);
    if (!one.mask.Empty()) {
      html += fmt::format("<img loading=\"lazy\" class=\"mask\" alt=\"{} {}\" src=\"{}\">", name,
                          shown, Embedded(one.mask, quality));
    }
    html += fmt::format(
        "<div class=\"side\" aria-hidden=\"true\">before</div><div class=\"side\" "
        "aria-hidden=\"true\">after</div></div><input type=\"range\" min=\"0\" max=\"100\" "
        "value=\"{1}\" aria-label=\"Before and after of {0}\">\n<figcaption>{0} ",
        name, one.slider);
    if (one.painted) html += "<span class=\"tag\">painted</span> ";
    if (one.heldout) html += "<span class=\"tag\">held out</span> ";
    if (options_.content) {
      const auto caption = options_.content->captions.find(one.view->name);
      if (caption != options_.content->captions.end()) {
        html += "<span class=\"quiet\">" + HtmlText(caption->second) + "</span> ";
      }
    } else if (one.quality) {
      const std::string& region = one.quality->region;
      html += fmt::format(
          "<span class=\"quiet\">inside {:.1f} dB{}, outside {:.1f} dB, {:.1f} % "
          "selected</span> ",
          one.quality->psnr_inside, region.empty() ? "" : " (" + HtmlText(region) + ")",
          one.quality->psnr_outside, 100 * one.selected);
    } else {
      html += "<span class=\"quiet\">nothing selected</span> ";
    }
    if (!one.mask.Empty()) {
      html += fmt::format("<button aria-pressed=\"false\" aria-label=\"{2} of {0}\">{1}</button>",
                          name, shown, options_.content ? "Photo" : "Mask");
    }
    html += "</figcaption></figure>\n";
  }
  return html + "</div>\n";
}

std::string Page::Figures() const {
  std::string html = "<dl class=\"figures\">\n";
  const auto add = [&](std::string_view name, const std::string& value) {
    html += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", HtmlText(name), HtmlText(value));
  };
  if (options_.content) {
    for (const auto& [name, value] : options_.content->figures) add(name, value);
    html += "</dl>\n";
    for (const std::string& sentence : options_.content->sentences) {
      html += "<p>" + HtmlText(sentence) + ".</p>\n";
    }
    return html;
  }
  const auto psnr = [&](std::string_view name, const QualityNumbers& numbers) {
    if (numbers.views == 0) return;
    add(fmt::format("inside, {} views", name), fmt::format("{:.1f} dB", numbers.psnr_inside_after));
    add(fmt::format("outside, {} views", name), fmt::format("{:.1f} dB", numbers.psnr_outside));
  };
  psnr("fitted", report_.quality.train);
  psnr("held out", report_.quality.heldout);
  for (const RegionReport& region : report_.regions) {
    if (report_.regions.size() == 1) break;  // its figures are those above
    psnr(region.name + ", fitted", region.quality.train);
    psnr(region.name + ", held out", region.quality.heldout);
  }
  add("views with a selection", fmt::format("{} of {}", report_.mask_views, report_.views));
  add("Gaussians changed",
      fmt::format("{} of {}", report_.refit.changed_gaussians, report_.gaussians));
  const auto total = report_.stages_ms.find("total");
  if (total != report_.stages_ms.end()) add("time", fmt::format("{:.1f} s", total->second / 1000));
  add("backend", report_.backend);
  return html + "</dl>\n";
}

std::string Page::Warnings() const {
  std::vector<std::string> warnings = options_.warnings;
  for (const PaintedReport& painted : report_.painted) {
    if (painted.registration.accepted) continue;
    warnings.push_back(painted.view + ": the selection was not moved to the sparse points (" +
                       painted.registration.reason + ").");
  }
  const double clipped = report_.quality.train.out_of_gamut;
  if (report_.quality.train.views > 0 && clipped > 0.01) {
    warnings.push_back(
        fmt::format("{:.0f} % of the selected pixels have a target that no screen "
                    "shows.",
                    100 * clipped));
  }
  if (warnings.empty()) return "";
  std::string html = "<h2>Warnings</h2>\n<ul class=\"warnings\">\n";
  for (const std::string& warning : warnings) html += "<li>" + HtmlText(warning) + "</li>\n";
  return html + "</ul>\n";
}

std::string Page::Paint(int quality) const {
  std::string html;
  for (const RegionPaint& one : paint_) {
    std::string verdict = one.verdict;
    verdict.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(verdict.front())));
    html +=
        fmt::format("<h2>Paint of {}</h2>\n<p>{}.</p>\n", HtmlText(one.region), HtmlText(verdict));
    if (one.views.empty()) continue;
    html +=
        "<p>Green: your paint that is selected. Yellow: selected beside it. Red: your paint that "
        "is left out.</p>\n<div class=\"paints\">\n";
    for (const PaintedPicture& view : one.views) {
      const std::string name = HtmlText(view.view), words = HtmlText(view.counts.Words());
      html += fmt::format(
          "<figure><img loading=\"lazy\" alt=\"{} paint\" src=\"{}\">\n<figcaption>{} <span "
          "class=\"quiet\">{}</span></figcaption></figure>\n",
          name, Embedded(view.picture, quality), name, words);
    }
    html += "</div>\n";
  }
  return html;
}

std::string Page::Plots() const {
  if (options_.content) return options_.content->plots;
  std::vector<Bar> inside, outside;
  for (const View* view : session_.scene().views()) {
    const auto found = quality_.find(view->name);
    if (found == quality_.end()) continue;
    inside.push_back({view->name, found->second.psnr_inside, found->second.heldout});
    outside.push_back({view->name, found->second.psnr_outside, found->second.heldout});
  }
  std::string html;
  const auto add = [&](std::string_view title, const std::string& plot) {
    if (!plot.empty()) html += fmt::format("<h2>{}</h2>\n{}", title, plot);
  };
  add("PSNR inside the selection, by view",
      BarPlot(inside, "dB", "PSNR inside the selection in dB, a bar for each view", "held out"));
  add("PSNR outside, by view",
      BarPlot(outside, "dB", "PSNR outside the selection in dB, a bar for each view", "held out"));
  add("Loss of the fit",
      LogLinePlot(report_.refit.losses, "sweeps", "Loss of the fit, on a logarithmic axis"));
  return html;
}

std::string Row(std::initializer_list<std::string> cells, const char* tag = "td") {
  std::string html = "<tr>";
  for (const std::string& cell : cells) {
    html += fmt::format("<{}{}>{}</{}>", tag, *(tag + 1) == 'h' ? " scope=\"col\"" : "",
                        HtmlText(cell), tag);
  }
  return html + "</tr>\n";
}

std::string ValueText(const OptionValue& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::string>) return v;
        return fmt::format("{}", v);
      },
      value);
}

std::string Page::Tables() const {
  std::string html;
  if (!report_.painted.empty()) {
    html += "<h2>Paint and registration</h2>\n<table>\n" +
            Row({"view", "depth", "points", "registration"}, "th");
    for (const PaintedReport& view : report_.painted) {
      html +=
          Row({view.view,
               fmt::format("{}, {:.1f} % measured", view.depth_method, 100 * view.valid_fraction),
               fmt::format("{} of {}", view.cloud.kept, view.cloud.sampled),
               view.registration.BriefReport()});
    }
    html += "</table>\n";
  }
  html += "<h2>Edit</h2>\n<table>\n" + Row({"region", "operations"}, "th");
  for (const Region& region : session_.store().regions().regions) {
    if (!region.visible) continue;
    html += Row({region.name, EditToJson(region.EffectiveEdit(), /*with_tables=*/false)});
  }
  html += "</table>\n";
  if (!report_.options.empty()) {
    html += "<h2>Options</h2>\n<table>\n" + Row({"option", "of", "value"}, "th");
    for (const OptionSetting& option : report_.options) {
      html += Row({option.name, option.applies, ValueText(option.value)});
    }
    html += "</table>\n";
  }
  if (!options_.command.empty()) {
    html += "<h2>The command that repeats it</h2>\n<pre>" + HtmlText(options_.command) + "</pre>\n";
  }
  return html;
}

std::string Page::Text() const {
  const std::string head = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}</style></head>\n<body><main>\n<h1>{0}</h1>\n"
      "<p>Retint {2}, {3} Gaussians, {4} views</p>\n",
      HtmlText(options_.title), kStyle, Version(), report_.gaussians, report_.views);
  const std::string before =
      head + Figures() + Warnings() +
      (options_.content ? "<h2>Views</h2>" : "<h2>Views, the worst first</h2>") +
      "\n<p>Move the slider: the original is "
      "on its left, the result on its right.</p>\n";
  const std::string after =
      Plots() + Tables() + fmt::format("</main>\n<script>{}</script></body></html>\n", kScript);
  for (const int quality : kQualities) {
    std::string page = before + Pictures(quality) + Paint(quality) + after;
    if (page.size() <= options_.most_bytes) return page;
  }
  throw RunError(fmt::format("the report's page of {} views does not fit into {} bytes",
                             views_.size(), options_.most_bytes));
}

}  // namespace

std::string HtmlReport(EditSession& session, const RunReport& report,
                       const HtmlReportOptions& options, Monitor& monitor) {
  Page page(session, report, options);
  page.Render(monitor);
  return page.Text();
}

}  // namespace retint
