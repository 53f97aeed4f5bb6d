// SPDX-License-Identifier: BSD-3-Clause
#include "base/json_node.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "base/error.h"

namespace retint::json {
namespace {

// How far the parser has read.
struct Place {
  int64_t line = 1;
  bool after_newline = false;  // the last byte read ended a line
};

// The bytes of a text, counting the lines that were read.
struct CountingIterator {
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  const char* at;
  Place* place;

  const char& operator*() const { return *at; }
  CountingIterator& operator++() {
    place->after_newline = *at++ == '\n';
    place->line += place->after_newline ? 1 : 0;
    return *this;
  }
  bool operator==(const CountingIterator& other) const { return at == other.at; }
  bool operator!=(const CountingIterator& other) const { return at != other.at; }
};

// Takes a JSON text's events and keeps the line of every value by its name.
class LineReader : public nlohmann::json_sax<Json> {
 public:
  LineReader(const std::filesystem::path& path, size_t size, LineIndex* lines)
      : path_(path), size_(size), lines_(lines) {}
  Place& place() { return place_; }

  bool null() override { return Value(false); }
  bool boolean(bool) override { return Value(false); }
  bool number_integer(number_integer_t) override { return Value(true); }
  bool number_unsigned(number_unsigned_t) override { return Value(true); }
  bool number_float(number_float_t, const string_t&) override { return Value(true); }
  bool string(string_t&) override { return Value(false); }
  bool binary(binary_t&) override { return Value(false); }
  bool start_object(size_t) override { return Start(/*list=*/false); }
  bool start_array(size_t) override { return Start(/*list=*/true); }
  bool end_object() override { return End(); }
  bool end_array() override { return End(); }
  bool key(string_t& name) override {
    // Values below a name have it before their own: few long ones would fill the memory.
    constexpr size_t kLongestName = 8192;
    Frame& object = frames_.back();
    object.next = object.name.empty() ? name : object.name + "." + name;
    if (object.next.size() > kLongestName) {
      throw InputError(path_, place_.line, "has a key that is too long");
    }
    if (!lines_->emplace(object.next, place_.line).second) {
      throw InputError(path_, place_.line, object.next + " comes twice");
    }
    return true;
  }
  bool parse_error(size_t position, const std::string& token,
                   const nlohmann::json::exception& error) override {
    constexpr int kNumberOutOfRange = 406;  // of nlohmann's exceptions
    throw InputError(path_, place_.line,
                     error.id == kNumberOutOfRange ? "holds a number that is out of range"
                     : position >= size_ || token == "<EOF>"
                         ? "is cut off: the JSON text has no end"
                         : "is not JSON at '" + token + "'");
  }

 private:
  struct Frame {
    std::string name, next;
    bool list = false;
    size_t count = 0;
  };

  // The name of the value that begins now, and its line. A number ends with the byte after it.
  std::string Begin(bool number) {
    if (frames_.empty()) return "";
    Frame& parent = frames_.back();
    if (!parent.list) return parent.next;
    const std::string name = parent.name + "[" + std::to_string(parent.count++) + "]";
    lines_->emplace(name, place_.line - (number && place_.after_newline ? 1 : 0));
    return name;
  }
  bool Value(bool number) {
    Begin(number);
    return true;
  }
  bool Start(bool list) {
    constexpr size_t kMostDepth = 64;
    const std::string name = Begin(false);
    if (frames_.size() == kMostDepth) {
      throw InputError(path_, place_.line, "is nested too deeply");
    }
    frames_.push_back({name, "", list, 0});
    return true;
  }
  bool End() {
    frames_.pop_back();
    return true;
  }

  const std::filesystem::path& path_;
  const size_t size_;
  LineIndex* lines_;
  Place place_;
  std::vector<Frame> frames_;
};

}  // namespace

Json ParseWithLines(const std::string& text, const std::filesystem::path& path, LineIndex* lines) {
  LineReader reader(path, text.size(), lines);
  const char* const begin = text.data();
  Json::sax_parse(CountingIterator{begin, &reader.place()},
                  CountingIterator{begin + text.size(), &reader.place()}, &reader);
  return Json::parse(text);
}

void Node::Fail(const std::string& fault) const {
  const std::string message = (name_.empty() ? "" : name_ + ": ") + fault;
  if (!lines_) throw InputError(*path_, message);
  const auto line = lines_->find(name_);
  throw InputError(*path_, line == lines_->end() ? 1 : line->second, message);
}

void Node::AllowOnly(std::initializer_list<std::string_view> known) const {
  if (!json_->is_object()) Fail("is not an object");
  for (const auto& [key, value] : json_->items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    std::string names;
    for (const std::string_view name : known) {
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
    At(key.c_str()).Fail("there is no such key here; there are " + names);
  }
}

Node Node::At(const char* key) const {
  if (!json_->is_object()) Fail("is not an object");
  const auto found = json_->find(key);
  const std::string name = (name_.empty() ? "" : name_ + ".") + key;
  if (found == json_->end()) Fail(std::string("has no \"") + key + "\"");
  return {*found, *path_, name, lines_};
}

std::vector<Node> Node::List() const {
  if (!json_->is_array()) Fail("is not a list");
  std::vector<Node> nodes;
  for (size_t i = 0; i < json_->size(); ++i) {
    nodes.emplace_back((*json_)[i], *path_, name_ + "[" + std::to_string(i) + "]", lines_);
  }
  return nodes;
}

std::vector<Node> Node::List(size_t n) const {
  std::vector<Node> nodes = List();
  if (nodes.size() != n) {
    Fail("has " + std::to_string(nodes.size()) + " values, not " + std::to_string(n));
  }
  return nodes;
}

std::string Node::Text() const {
  if (!json_->is_string()) Fail("is not a text");
  return json_->get<std::string>();
}

bool Node::Bool() const {
  if (!json_->is_boolean()) Fail("is neither true nor false");
  return json_->get<bool>();
}

double Node::Number() const {
  if (!json_->is_number()) Fail("is not a number");
  const double value = json_->get<double>();
  if (!std::isfinite(value)) Fail("is not a finite number");
  return value;
}

float Node::Float() const {
  const double value = Number();
  if (std::abs(value) > std::numeric_limits<float>::max()) Fail("is too large");
  return static_cast<float>(value);
}

uint64_t Node::Unsigned(uint64_t max) const {
  if (!json_->is_number_unsigned()) Fail("is not a whole number from 0 on");
  const auto value = json_->get<uint64_t>();
  if (value > max) Fail("is " + std::to_string(value) + ", more than " + std::to_string(max));
  return value;
}

int64_t Node::Signed(int64_t min, int64_t max) const {
  if (!json_->is_number_integer()) Fail("is not a whole number");
  const bool huge = json_->is_number_unsigned() && json_->get<uint64_t>() > uint64_t(INT64_MAX);
  const int64_t value = huge ? INT64_MAX : json_->get<int64_t>();
  if (value < min || value > max) {
    Fail("is not between " + std::to_string(min) + " and " + std::to_string(max));
  }
  return value;
}

uint64_t Node::Hex() const {
  const std::string text = Text();
  uint64_t value = 0;
  bool good = text.size() == 16;
  for (const char c : text) {
    good = good && HexValue(c) >= 0;
    value = (value << 4) | static_cast<uint64_t>(HexValue(c) & 15);
  }
  if (!good) Fail("is not sixteen hexadecimal digits");
  return value;
}

}  // namespace retint::json
