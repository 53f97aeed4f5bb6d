// SPDX-License-Identifier: BSD-3-Clause
// The reaction to bad input: one line on stderr with file and fault, the right exit code, and no
// output. One row for each fault; each including file has the rows of one subject.
#pragma once

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "selection/selection_cloud.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {

namespace fs = std::filesystem;

// A spoilt copy of the sample workspace and where outputs would go.
struct Place {
  TempFolder temp;
  fs::path in = temp.path() / "in", out = temp.path() / "out";
  Place() {
    fs::create_directories(out);
    fs::create_directories(in);
    for (const char* part : {"sparse", "images", "masks", "splat.ply"}) {
      fs::copy(TinyWorkspace() / part, in / part, fs::copy_options::recursive);
    }
  }
  std::string In(const std::string& name) const { return (in / name).string(); }
  std::string Out(const std::string& name) const { return (out / name).string(); }
};

using Arguments = std::vector<std::string>;

struct Row {
  const char* name;
  int code;
  const char* says;  // part of the line
  // Spoils the copy and says what to run.
  Arguments (*prepare)(Place& place);
};

inline Arguments With(const Place& place, const std::string& verb, const Arguments& more) {
  Arguments arguments = {verb, place.in.string(), "--splat", place.In("splat.ply")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// A whole recolor of the copy; `key value` pairs replace options or add them.
inline Arguments Recolor(const Place& place, const Arguments& replace = {}) {
  Arguments arguments =
      With(place, "recolor",
           {"--view", TinyView(), "--mask", place.In("masks/" + TinyView() + ".png"), "--tint",
            "#3060ff", "--output", place.Out("out.ply"), "--report", place.Out("r.json"),
            "--save-stages", place.Out("stages"), "--comparison", place.Out("c.png")});
  for (size_t i = 0; i + 1 < replace.size(); i += 2) {
    if (replace[i] == "SCENE") {
      arguments[1] = replace[i + 1];
      continue;
    }
    const auto found = std::find(arguments.begin(), arguments.end(), replace[i]);
    if (found != arguments.end()) {
      *(found + 1) = replace[i + 1];
    } else {
      arguments.insert(arguments.end(), {replace[i], replace[i + 1]});
    }
  }
  return arguments;
}

inline void Truncate(const fs::path& path, double share) {
  fs::resize_file(path, static_cast<uintmax_t>(share * static_cast<double>(fs::file_size(path))));
}

template <typename T>
void Overwrite(const fs::path& path, size_t offset, T value) {
  std::string bytes = ReadFile(path);
  std::memcpy(bytes.data() + offset, &value, sizeof value);
  WriteFile(path, bytes);
}

inline void Replace(const fs::path& path, const std::string& from, const std::string& to) {
  std::string bytes = ReadFile(path);
  const size_t at = bytes.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  WriteFile(path, bytes.replace(at, from.size(), to));
}

// Value `which` of the first Gaussian: the header names the columns in order, four bytes each.
inline void SpoilGaussian(const fs::path& path, const std::string& column, float value) {
  const std::string bytes = ReadFile(path);
  const size_t data = bytes.find("end_header\n") + std::strlen("end_header\n");
  size_t index = 0, at = 0;
  while ((at = bytes.find("property float ", at)) < data) {
    at += std::strlen("property float ");
    if (bytes.compare(at, column.size() + 1, column + "\n") == 0) break;
    ++index;
  }
  Overwrite(path, data + 4 * index, value);
}

inline fs::path MaskOf(const Place& place) { return place.in / "masks" / (TinyView() + ".png"); }

inline SelectionCloud CloudAt(const Eigen::Vector3f& position) {
  SelectionCloud cloud;
  for (int i = 0; i < 50; ++i) {
    SelectionPoint point;
    point.position = position + Eigen::Vector3f(0, 0, 0.01F * static_cast<float>(i));
    point.normal = {0, 0, -1};
    point.footprint = 0.01F;
    cloud.points.push_back(point);
  }
  cloud.sources = {"000.png"};
  return cloud;
}

inline std::string RowName(const testing::TestParamInfo<Row>& row) { return row.param.name; }

// No output, one line, the right code, and the fault in the line.
inline void ExpectRefused(const CommandResult& result, const Place& place, int code,
                          const std::string& says) {
  EXPECT_EQ(result.code, code) << result.err;
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_EQ(result.err.rfind("retint: ", 0), 0u) << result.err;
  EXPECT_THAT(result.err, testing::HasSubstr(says));
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(FilesBelow(place.out), testing::IsEmpty());
  for (const std::string& name : FilesBelow(place.temp.path())) {
    EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
  }
}

// Its only test is in bad_usage_test.cc.
class BadInput : public testing::TestWithParam<Row> {};

}  // namespace retint
