// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usda_reader.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "base/error.h"

namespace retint {
namespace {

constexpr size_t kMostNumbers = 16;  // of a value that is not an array: those of a matrix

bool IsWordLetter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == ':' || c == '.' ||
         static_cast<unsigned char>(c) >= 0x80;
}

// The tokens of the grammar.
class Scanner {
 public:
  Scanner(std::string_view text, const std::filesystem::path& path) : text_(text), path_(path) {}

  [[noreturn]] void Fail(const std::string& fault) const {
    const auto end = text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size()));
    throw InputError(
        path_, "line " + std::to_string(1 + std::count(text_.begin(), end, '\n')) + ": " + fault);
  }

  // The next character that is not a space or in a comment; 0 at the end.
  char Next() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == ';') {
        ++at_;
      } else if (c == '#' || text_.substr(at_, 2) == "//") {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (text_.substr(at_, 2) == "/*") {
        const size_t end = text_.find("*/", at_ + 2);
        at_ = end == std::string_view::npos ? text_.size() : end + 2;
      } else {
        return c;
      }
    }
    return 0;
  }

  bool Take(char c) {
    if (Next() != c) return false;
    ++at_;
    return true;
  }

  void Expect(char c) {
    if (Take(c)) return;
    std::string mark = "\"\"";
    mark.insert(1, 1, c);
    Fail(at_ >= text_.size() ? "truncated: " + mark + " is missing" : mark + " is expected");
  }

  // Letters, digits and other characters of names; empty if there are none.
  std::string_view Word() {
    Next();
    const size_t begin = at_;
    while (at_ < text_.size() && IsWordLetter(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }

  std::string String() {
    const char quote = Next();
    if (quote != '"' && quote != '\'') Fail("a text in quotation marks is expected");
    const std::string three(3, quote);
    const bool lines = text_.substr(at_, 3) == three;
    at_ += lines ? 3 : 1;
    std::string value;
    while (at_ < text_.size()) {
      if (lines ? text_.substr(at_, 3) == three : text_[at_] == quote) {
        at_ += lines ? 3 : 1;
        return value;
      }
      if (text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
      value += text_[at_++];
    }
    Fail("truncated: a text has no end");
  }

  double Number() {
    const char c = Next();
    double value = 0;
    const char* const begin = text_.data() + at_;
    const auto [end, code] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (code == std::errc::result_out_of_range) {
      // The number is too small for a double, or too large.
      const std::string_view digits(begin, static_cast<size_t>(end - begin));
      const bool tiny = digits.find("e-") != std::string_view::npos ||
                        digits.find("E-") != std::string_view::npos;
      value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
      if (c == '-') value = -value;
    } else if (code != std::errc()) {
      Fail(c == 0 ? "truncated: a number is missing" : "a number is expected");
    }
    at_ += static_cast<size_t>(end - begin);
    return value;
  }

  // The numbers of a value that is not an array.
  std::vector<double> Numbers() {
    std::vector<double> numbers;
    size_t open = 0;
    do {
      while (Take('(')) ++open;
      if (open > 2 || numbers.size() == kMostNumbers) Fail("a value has too many parts");
      numbers.push_back(Number());
      while (open > 0 && Take(')')) --open;
      if (open > 0) Expect(',');
    } while (open > 0);
    return numbers;
  }

  // Skips any value: brackets with their contents, a text, a path, a word.
  void SkipValue() {
    std::vector<char> open;
    do {
      const char c = Next();
      if (c == '(' || c == '[' || c == '{') {
        open.push_back(c == '(' ? ')' : c == '[' ? ']' : '}');
        ++at_;
      } else if (c == ')' || c == ']' || c == '}') {
        if (open.empty() || open.back() != c) Fail("a bracket closes that is not open");
        open.pop_back();
        ++at_;
      } else if (c == '"' || c == '\'') {
        String();
      } else if (c == '@') {
        const bool three = text_.substr(at_, 3) == "@@@";
        SkipTo(three ? "@@@" : "@", three ? 3 : 1);
      } else if (c == '<') {
        SkipTo(">", 1);
      } else if (c == 0) {
        Fail("truncated: a value has no end");
      } else if (std::isdigit(static_cast<unsigned char>(c)) || c == '-' || c == '+' || c == '.') {
        if (c == '+') ++at_;
        Number();
      } else if (Word().empty()) {
        ++at_;  // a comma
      }
    } while (!open.empty());
  }

  // The value may be a reference: an asset, a path and an offset.
  void SkipMetadataValue() {
    const char kind = Next();
    SkipValue();
    if (kind != '@' && kind != '<') return;
    if (Next() == '<') SkipValue();
    if (Next() == '(') SkipValue();
  }

  size_t at() const { return at_; }
  void Advance() { ++at_; }
  bool at_end() { return Next() == 0; }
  std::string_view text() const { return text_; }

 private:
  void SkipTo(std::string_view mark, size_t from) {
    size_t end = text_.find(mark, at_ + from);
    // An escaped mark is not the end.
    while (mark.size() == 3 && end != std::string_view::npos && text_[end - 1] == '\\') {
      end = text_.find(mark, end + mark.size());
    }
    if (end == std::string_view::npos) Fail("truncated: a value has no end");
    at_ = end + mark.size();
  }

  std::string_view text_;
  const std::filesystem::path& path_;
  size_t at_ = 0;
};

// For ForEachUsdaElement(); stops at the end of the brackets or of the text.
template <typename Each>
void Elements(Scanner& scan, size_t components, const Each& each) {
  std::array<double, 4> numbers{};
  for (char c = scan.Next(); c != ']' && c != 0; c = scan.Next()) {
    const size_t begin = scan.at();
    if (components > 1) scan.Expect('(');
    for (size_t i = 0; i < components; ++i) {
      if (i > 0) scan.Expect(',');
      numbers[i] = scan.Number();
    }
    if (components > 1) scan.Expect(')');
    each(numbers.data(), begin, scan.at());
    if (!scan.Take(',')) break;
  }
}

class LayerReader {
 public:
  LayerReader(std::string_view text, const std::filesystem::path& path) : scan_(text, path) {}

  UsdStage Read() && {
    if (scan_.Take('(')) {
      Metadata([&](std::string_view name) { return LayerField(name); });
    }
    while (!scan_.at_end()) {
      const std::string_view word = scan_.Word();
      if (IsSpecifier(word)) {
        Prim(word, -1, 0);
      } else if (word == "reorder") {
        scan_.Word();
        scan_.Expect('=');
        scan_.SkipValue();
      } else {
        scan_.Fail("a prim is expected");
      }
    }
    return std::move(stage_);
  }

 private:
  static bool IsSpecifier(std::string_view word) {
    return word == "def" || word == "over" || word == "class";
  }

  static bool IsListEdit(std::string_view word) {
    return word == "add" || word == "append" || word == "prepend" || word == "delete" ||
           word == "reorder";
  }

  // The contents of parentheses. `field(name)` reads a value or returns false.
  template <typename Field>
  void Metadata(const Field& field) {
    while (!scan_.Take(')')) {
      if (scan_.Next() == '"' || scan_.Next() == '\'') {
        scan_.String();
        continue;
      }
      std::string_view name = scan_.Word();
      if (IsListEdit(name) && scan_.Next() != '=') name = scan_.Word();
      if (name.empty()) scan_.Fail("a name is expected, or \")\"");
      if (!scan_.Take('=')) continue;
      for (const char* arc : {"references", "payload", "subLayers", "inherits", "specializes"}) {
        if (name == arc) stage_.refers = true;
      }
      if (!field(name)) scan_.SkipMetadataValue();
    }
  }

  bool LayerField(std::string_view name) {
    if (name == "upAxis") {
      stage_.z_up = scan_.String() == "Z";
    } else if (name == "metersPerUnit") {
      stage_.meters_per_unit = scan_.Number();
    } else {
      return false;
    }
    return true;
  }

  void Prim(std::string_view specifier, int64_t parent, size_t depth) {
    if (depth > kMostUsdDepth || stage_.prims.size() == kMostUsdPrims) {
      scan_.Fail("holds more prims than is supported, or nests them deeper");
    }
    const auto index = static_cast<int64_t>(stage_.prims.size());
    stage_.prims.emplace_back();
    UsdPrim prim;
    prim.parent = parent;
    prim.defined = specifier == "def";
    prim.type = scan_.Word();
    prim.name = scan_.String();
    if (scan_.Take('(')) {
      Metadata([&](std::string_view name) {
        if (name != "active") return false;
        prim.active = Flag();
        return true;
      });
    }
    scan_.Expect('{');
    stage_.prims[static_cast<size_t>(index)] = std::move(prim);
    while (!scan_.Take('}')) Member(index, depth);
  }

  bool Flag() {
    const std::string_view word = scan_.Word();
    return word != "0" && word != "false" && word != "False";
  }

  void Member(int64_t prim, size_t depth) {
    std::string_view word = scan_.Word();
    if (IsSpecifier(word)) return Prim(word, prim, depth + 1);
    if (word == "variantSet") {
      stage_.variants = true;
      scan_.String();
      scan_.Expect('=');
      return scan_.SkipValue();
    }
    for (const char* prefix : {"custom", "uniform", "varying", "config"}) {
      if (word == prefix) word = scan_.Word();
    }
    if (IsListEdit(word)) word = scan_.Word();
    for (const char* prefix : {"custom", "uniform", "varying"}) {
      if (word == prefix) word = scan_.Word();
    }
    if (word.empty()) scan_.Fail("an attribute or a prim is expected");
    const bool is_array = scan_.Take('[');
    if (is_array) scan_.Expect(']');
    const std::string_view type = word, name = scan_.Word();
    UsdPrim& owner = stage_.prims[static_cast<size_t>(prim)];
    if (scan_.Take('=')) Value(owner, type, name, is_array);
    if (scan_.Take('(')) {
      const auto kept = owner.attributes.find(name);
      Metadata([&](std::string_view field) {
        if (field != "colorSpace" || kept == owner.attributes.end()) return false;
        kept->second.color_space = scan_.String();
        return true;
      });
    }
  }

  // Reads a value after "=".
  void Value(UsdPrim& prim, std::string_view type, std::string_view name, bool is_array) {
    const size_t dot = name.find('.');
    const std::string_view attribute = name.substr(0, dot);
    const std::string_view part =
        dot == std::string_view::npos ? std::string_view() : name.substr(dot + 1);
    if (!IsUsdAttribute(prim.type, attribute) || prim.attributes.size() >= kMostUsdAttributes) {
      return scan_.SkipValue();
    }
    UsdValue& value = prim.attributes[std::string(attribute)];
    value.animated = value.animated || part == "timeSamples" || part == "spline";
    const size_t components = UsdArrayComponents(attribute);
    const char c = scan_.Next();
    if (!part.empty() || c == 'N') return scan_.SkipValue();  // None
    if (is_array && components > 0) return Array(value, components);
    if (is_array && c == '[') return Tokens(value);
    if (c == '"' || c == '\'') {
      value.text = scan_.String();
    } else if (!is_array &&
               (type.find_first_of("0123456789") != std::string_view::npos || type == "float" ||
                type == "double" || type == "half" || type == "int" || type.starts_with("quat"))) {
      value.numbers = scan_.Numbers();
    } else {
      scan_.SkipValue();
    }
  }

  void Tokens(UsdValue& value) {
    value.tokens.clear();
    scan_.Expect('[');
    while (!scan_.Take(']')) {
      if (scan_.Next() != '"' && scan_.Next() != '\'') scan_.Fail("a list of texts is expected");
      if (value.tokens.size() == kMostUsdAttributes) scan_.Fail("a list of texts is too long");
      value.tokens.push_back(scan_.String());
      scan_.Take(',');
    }
  }

  void Array(UsdValue& value, size_t components) {
    scan_.Expect('[');
    value.floats.clear();
    value.components = components;
    value.storage = UsdStorage::kText;
    value.begin = scan_.at();
    Elements(scan_, components, [&](const double* numbers, size_t, size_t) {
      for (size_t i = 0; i < components; ++i) {
        value.floats.push_back(static_cast<float>(numbers[i]));
      }
    });
    value.end = scan_.at();
    scan_.Expect(']');
  }

  Scanner scan_;
  UsdStage stage_;
};

}  // namespace

UsdStage ReadUsda(std::string_view text, const std::filesystem::path& path) {
  return LayerReader(text, path).Read();
}

void ForEachUsdaElement(std::string_view elements, size_t components,
                        const std::filesystem::path& path, const UsdaElement& each) {
  Scanner scan(elements, path);
  Elements(scan, components, each);
}

}  // namespace retint
