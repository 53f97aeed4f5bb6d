// SPDX-License-Identifier: BSD-3-Clause
#include "opening/render_model.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/files.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr uintmax_t kMostBytes = uintmax_t{1} << 20;  // of a configuration

// "rasterize_mode: antialiased" of a line of YAML, without indentation, quotes and doubled blanks.
std::string Bare(std::string_view line) {
  std::string bare;
  for (const char c : line) {
    if (c == '#') break;
    if (c == '\'' || c == '"' || c == '\r') continue;
    const bool blank = c == ' ' || c == '\t';
    if (!blank || (!bare.empty() && bare.back() != ' ')) bare += blank ? ' ' : c;
  }
  while (!bare.empty() && bare.back() == ' ') bare.pop_back();
  return bare;
}

// The line that says that the trainer filtered; empty: none.
std::string FilterLine(const std::string& text) {
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = Bare(std::string_view(text).substr(begin, end - begin));
    if (line == "rasterize_mode: antialiased" || line == "antialiased: true") return line;
    begin = end + 1;
  }
  return {};
}

}  // namespace

void ChooseRenderModel(std::optional<RenderModel> chosen, const fs::path& splat,
                       const fs::path& workspace, GaussianModel& model) {
  SplatTraits& traits = model.traits;
  if (chosen) {
    traits.render_model = *chosen;
    traits.render_model_reason = "chosen";
    return;
  }
  if (!traits.render_model_reason.empty()) return;
  std::vector<fs::path> folders;
  if (!splat.empty()) {
    const fs::path folder = fs::absolute(splat).lexically_normal().parent_path();
    folders = {folder, folder.parent_path()};
  }
  if (!workspace.empty()) folders.push_back(workspace);
  for (const fs::path& folder : folders) {
    for (const char* const name : {"config.yml", "cfg.yml"}) {
      const fs::path file = folder / name;
      std::error_code code;
      if (!IsFile(file) || fs::file_size(file, code) > kMostBytes || code) continue;
      const std::string line = FilterLine(ReadFile(file));
      if (line.empty()) continue;
      traits.render_model = RenderModel::kMip;
      traits.render_model_reason = file.string() + ": " + line;
      return;
    }
  }
}

}  // namespace retint
