// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_tags.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <string_view>
#include <utility>

namespace retint {
namespace {

// The tag in a line of a header.
struct Tag {
  std::optional<RenderModel> render_model;
  std::optional<ColorSpace> color_space;
  std::string unknown;  // a value without meaning to Retint
  bool is_render_model = false, is_color_space = false;
};

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// The words of a line, separated by blanks, colons and equal signs.
std::vector<std::string> WordsOf(std::string_view line) {
  std::vector<std::string> words;
  std::string word;
  for (const char c : line) {
    const bool ends = std::isspace(static_cast<unsigned char>(c)) || c == ':' || c == '=';
    if (!ends) word += c;
    if (ends && !word.empty()) words.push_back(std::exchange(word, {}));
  }
  if (!word.empty()) words.push_back(word);
  return words;
}

Tag TagOf(std::string_view line) {
  Tag tag;
  const std::vector<std::string> words = WordsOf(line);
  if (words.size() != 3 || words[0] != "comment") return tag;
  const std::string name = Lower(words[1]), value = Lower(words[2]);
  if (name == "splatrendermode") {
    tag.is_render_model = true;
    tag.render_model = RenderModelNamed(value);
    if (!tag.render_model) tag.unknown = words[2];
  } else if (name == "antialiased" && (value == "0" || value == "1")) {
    tag.is_render_model = true;
    tag.render_model = value == "1" ? RenderModel::kMip : RenderModel::kDefault;
  } else if (name == "colorspace") {
    tag.is_color_space = true;
    tag.color_space = ColorSpaceNamed(value);
    if (!tag.color_space) tag.unknown = words[2];
  }
  return tag;
}

}  // namespace

void ReadTags(GaussianModel& model) {
  for (const std::string& line : model.source.comments) {
    const Tag tag = TagOf(line);
    if (tag.render_model) {
      model.traits.render_model = *tag.render_model;
      model.traits.render_model_reason = line;
    }
    if (tag.color_space) model.traits.color_space = *tag.color_space;
    if (!tag.unknown.empty()) {
      model.source.notes.push_back("'" + line + "' is not known, and is ignored");
    }
  }
}

std::vector<std::string> TaggedComments(const GaussianModel& model) {
  GaussianModel said;
  said.source.comments = model.source.comments;
  ReadTags(said);
  const bool new_model = said.traits.render_model != model.traits.render_model;
  const bool new_space = said.traits.color_space != model.traits.color_space;
  std::vector<std::string> comments;
  for (const std::string& line : model.source.comments) {
    const Tag tag = TagOf(line);
    if ((new_model && tag.is_render_model) || (new_space && tag.is_color_space)) continue;
    comments.push_back(line);
  }
  if (new_model) {
    comments.push_back("comment SplatRenderMode: " +
                       std::string(NameOf(model.traits.render_model)));
  }
  if (new_space) {
    comments.push_back("comment ColorSpace " + std::string(NameOf(model.traits.color_space)));
  }
  return comments;
}

void NoteRenderModel(GaussianModel& model) {
  if (model.traits.render_model == RenderModel::k2dgs) {
    model.source.notes.emplace_back(
        "this is a splat of 2D Gaussians (2DGS): they are rendered as flat 3D Gaussians, which "
        "look different at grazing angles. Edits change colors only, and a .ply keeps the discs");
  } else if (model.traits.render_model == RenderModel::k3dgut) {
    model.source.notes.emplace_back(
        "this splat was trained with 3DGUT: it is rendered as an ordinary splat, so that large "
        "Gaussians near the edges of wide views look different. Edits change colors only");
  }
}

}  // namespace retint
