// SPDX-License-Identifier: BSD-3-Clause
// A report to look at: one page that needs no other file and no network.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "editing/edit_session.h"
#include "reporting/report.h"

namespace retint {

// Of a run that has no masks: in place of the figures, captions and plots of a recoloring. A button
// shows a view's photo instead of its mask.
struct HtmlContent {
  std::vector<std::string> sentences;
  std::vector<std::pair<std::string, std::string>> figures;  // name, value
  std::map<std::string, std::string> captions;               // by view
  std::string plots;                                         // HTML
};

struct HtmlReportOptions {
  std::string title = "Recoloring";   // of the page
  std::string command;                // that makes the same result again; may be empty
  std::vector<std::string> warnings;  // sentences for people
  std::optional<HtmlContent> content;
  size_t most_bytes = 9'500'000;  // of the page; pictures get smaller and coarser for it
};

// Shows before, mask and after of every view, with a slider between them, lowest PSNR first. The
// painted masks and the selection, in words and pictures. PSNR by view and loss, as plots. Masks,
// registration, edits, options and command, as tables. `report` is the session's (MakeReport() or
// FullReport()) with its quality filled in. The renderer is left with the original coefficients.
// RunError if the page cannot be made small enough. Stage: "pictures".
std::string HtmlReport(EditSession& session, const RunReport& report,
                       const HtmlReportOptions& options, Monitor& monitor);

}  // namespace retint
