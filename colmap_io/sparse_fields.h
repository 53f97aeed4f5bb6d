// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: the records of a sparse model's text files and the fields of a record.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/error.h"
#include "colmap_io/sparse_codec.h"

namespace retint::sparse_codec {

inline constexpr std::string_view kBlanks = " \t\r\v\f";

inline std::string_view Trim(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

// The lines of a text file, counted from 1.
class Lines {
 public:
  Lines(std::string_view text, const Path& path) : rest_(text), path_(path) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
  }
  // The next line as it stands, trimmed; nullopt at the end of the file.
  std::optional<std::string_view> Next() {
    if (rest_.empty()) return std::nullopt;
    const size_t end = rest_.find('\n');
    const std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++number_;
    return Trim(line);
  }
  // The next line that is neither empty nor a comment. Comments that tell how many records follow
  // ("# Number of images: 11, ...") are kept.
  std::optional<std::string_view> NextRecord() {
    while (const auto line = Next()) {
      if (!line->empty() && line->front() != '#') return line;
      NoteCount(*line);
    }
    return std::nullopt;
  }
  // A file cut between two records is otherwise complete in itself.
  void WarnIfFewer(size_t count, Warnings& warnings) const {
    if (told_count_ && count < *told_count_) {
      warnings.push_back(path_.string() + ": its comment tells of " + std::to_string(*told_count_) +
                         " records, " + std::to_string(count) + " follow");
    }
  }
  const Path& path() const { return path_; }
  int64_t number() const { return number_; }

 private:
  void NoteCount(std::string_view comment) {
    const size_t colon = comment.find(':');
    if (!comment.starts_with("# Number of ") || colon == std::string_view::npos) return;
    const std::string_view digits = Trim(comment.substr(colon + 1));
    size_t count = 0;
    if (std::from_chars(digits.data(), digits.data() + digits.size(), count).ec == std::errc{}) {
      told_count_ = count;
    }
  }

  std::string_view rest_;
  const Path& path_;
  int64_t number_ = 0;
  std::optional<size_t> told_count_;
};

// The blank-separated fields of one line; faults name the file, the line and the field.
class Fields {
 public:
  Fields(std::string_view line, const Lines& lines) : rest_(line), lines_(lines) {}

  bool AtEnd() {
    rest_ = Trim(rest_);
    return rest_.empty();
  }
  std::string_view Word(const char* what) {
    if (AtEnd()) Fail(std::string(what) + " is missing");
    const size_t end = std::min(rest_.find_first_of(kBlanks), rest_.size());
    const std::string_view word = rest_.substr(0, end);
    rest_.remove_prefix(end);
    return word;
  }
  std::string_view Rest(const char* what) {
    if (AtEnd()) Fail(std::string(what) + " is missing");
    return rest_;
  }
  template <typename T>
  T Integer(const char* what) {
    const std::string_view word = Word(what);
    T value{};
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (code != std::errc{} || end != word.data() + word.size()) NotANumber(what, word, "integer");
    return value;
  }
  double Number(const char* what) {
    std::string_view word = Word(what);
    if (word.size() > 1 && word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (code == std::errc::result_out_of_range) {
      const bool tiny = word.find("e-") != word.npos || word.find("E-") != word.npos;
      if (!tiny) FailRecord(std::string(what) + " is out of range");
      return 0;
    }
    if (code != std::errc{} || end != word.data() + word.size()) NotANumber(what, word, "number");
    if (!std::isfinite(value)) {
      FailRecord(std::string(what) + (std::isnan(value) ? " is NaN" : " is infinite"));
    }
    return value;
  }
  [[noreturn]] void Fail(const std::string& fault) const {
    throw InputError(lines_.path(), lines_.number(), fault);
  }
  // For a fault after which the next record can be read.
  [[noreturn]] void FailRecord(const std::string& fault) const {
    throw BadRecord(lines_.path(), lines_.number(), fault);
  }

 private:
  [[noreturn]] void NotANumber(const char* what, std::string_view word, const char* kind) const {
    constexpr size_t kShown = 40;
    Fail(std::string(what) + " is not " + (kind[0] == 'i' ? "an " : "a ") + kind + ": \"" +
         std::string(word.substr(0, kShown)) + "\"" +
         (word.ends_with(',') ? " (fields are separated by blanks, not by commas)" : ""));
  }

  std::string_view rest_;
  const Lines& lines_;
};

// QW, QX, QY, QZ, TX, TY, TZ of `whose` ("image 7"), with a unit quaternion.
inline Rigid3d ReadPose(Fields& fields, const std::string& whose) {
  Rigid3d pose;
  pose.rotation.w() = fields.Number("QW");
  pose.rotation.x() = fields.Number("QX");
  pose.rotation.y() = fields.Number("QY");
  pose.rotation.z() = fields.Number("QZ");
  pose.translation.x() = fields.Number("TX");
  pose.translation.y() = fields.Number("TY");
  pose.translation.z() = fields.Number("TZ");
  if (!NormalizeRotation(pose.rotation)) fields.FailRecord(whose + " has a zero rotation");
  return pose;
}

}  // namespace retint::sparse_codec
