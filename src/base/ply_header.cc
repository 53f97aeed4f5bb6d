// SPDX-License-Identifier: BSD-3-Clause
#include "base/ply_header.h"

#include <algorithm>
#include <charconv>
#include <unordered_set>

#include "base/error.h"

namespace retint {
namespace {

std::vector<std::string_view> Words(std::string_view line) {
  std::vector<std::string_view> words;
  size_t begin = 0;
  while ((begin = line.find_first_not_of(" \t", begin)) != std::string_view::npos) {
    const size_t end = std::min(line.find_first_of(" \t", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

// A piece of the file that is safe to show in a one-line message.
std::string Quoted(std::string_view text) {
  std::string shown(text.substr(0, 40));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < 0x20 || c > 0x7e; }, '?');
  return "\"" + shown + (text.size() > 40 ? "...\"" : "\"");
}

class HeaderParser {
 public:
  HeaderParser(std::string_view head, const std::filesystem::path& path)
      : head_(head), path_(path) {}

  PlyHeader Parse() {
    if (NextLine() != "ply") throw InputError(path_, "not a PLY file");
    for (std::string_view line = NextLine(); line != "end_header"; line = NextLine()) {
      ParseLine(line);
    }
    if (header_.format.empty()) throw InputError(path_, "PLY header has no format line");
    header_.bytes = position_;
    header_.lines = line_;
    return std::move(header_);
  }

 private:
  std::string_view NextLine() {
    const size_t end = head_.find('\n', position_);
    if (end == std::string_view::npos) {
      throw InputError(path_, line_ == 0 ? std::string("not a PLY file")
                                         : "PLY header has no end_header line" +
                                               std::string(head_.size() >= kMaxPlyHeaderBytes
                                                               ? " in its first MiB"
                                                               : ""));
    }
    std::string_view line = head_.substr(position_, end - position_);
    position_ = end + 1;
    ++line_;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }

  [[noreturn]] void Fail(const std::string& fault) const { throw InputError(path_, line_, fault); }

  void ParseLine(std::string_view line) {
    const std::vector<std::string_view> words = Words(line);
    if (words.empty()) Fail("empty line in the PLY header");
    if (words[0] == "comment" || words[0] == "obj_info") {
      header_.comments.emplace_back(line);
    } else if (words[0] == "format") {
      ParseFormat(words);
    } else if (words[0] == "element") {
      ParseElement(words);
    } else if (words[0] == "property") {
      ParseProperty(words);
    } else {
      Fail("unknown PLY header line " + Quoted(line));
    }
  }

  void ParseFormat(const std::vector<std::string_view>& words) {
    if (words.size() != 3 || words[2] != "1.0") Fail("expected a format line of version 1.0");
    if (!header_.format.empty()) Fail("second format line");
    header_.format = words[1];
  }

  void ParseElement(const std::vector<std::string_view>& words) {
    PlyElement element;
    element.line = line_;
    const char* end = words.size() == 3 ? words[2].data() + words[2].size() : nullptr;
    if (!end || std::from_chars(words[2].data(), end, element.count).ptr != end ||
        std::to_string(element.count) != words[2]) {
      Fail("expected \"element NAME COUNT\"");
    }
    element.name = words[1];
    if (!element_names_.insert(element.name).second) {
      Fail("second element " + Quoted(element.name));
    }
    property_names_.clear();
    header_.elements.push_back(std::move(element));
  }

  void ParseProperty(const std::vector<std::string_view>& words) {
    if (header_.elements.empty()) Fail("property before any element");
    PlyProperty property;
    property.line = line_;
    if (words.size() == 5 && words[1] == "list") {
      if (!PlyTypeBytes(words[2]) || !PlyTypeBytes(words[3])) Fail("unknown type of a list");
      property.type = "list " + std::string(words[2]) + " " + std::string(words[3]);
    } else if (words.size() == 3) {
      property.type = words[1];
      property.bytes = PlyTypeBytes(words[1]);
      if (property.bytes == 0) Fail("unknown type " + Quoted(words[1]));
    } else {
      Fail("expected \"property TYPE NAME\"");
    }
    property.name = words.back();
    if (!property_names_.insert(property.name).second) {
      Fail("second property " + Quoted(property.name));
    }
    header_.elements.back().properties.push_back(std::move(property));
  }

  std::string_view head_;
  const std::filesystem::path& path_;
  PlyHeader header_;
  std::unordered_set<std::string> element_names_, property_names_;  // the latter of one element
  size_t position_ = 0;
  int64_t line_ = 0;
};

}  // namespace

PlyHeader ParsePlyHeader(std::string_view head, const std::filesystem::path& path) {
  return HeaderParser(head, path).Parse();
}

int PlyTypeBytes(std::string_view type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32") return 4;
  if (type == "float" || type == "float32") return 4;
  if (type == "double" || type == "float64") return 8;
  return 0;
}

}  // namespace retint
