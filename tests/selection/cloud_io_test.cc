// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "selection/selection_cloud.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

SelectionCloud Sample() {
  SelectionCloud cloud;
  cloud.sources = {"plain.jpg", "two words/ü.png", "line\nbreak 100%.png"};
  for (int i = 0; i < 5; ++i) {
    SelectionPoint point;
    point.position = {1.5f + float(i), -2.25f, 1e-7f};
    point.normal = {0, 0.6f, -0.8f};
    point.footprint = 0.01f * float(i + 1);
    point.confidence = i % 2 ? 0.5f : 1.0f;
    point.coverage = 0.2f * float(i + 1);
    point.color = {uint8_t(i), 128, 255};
    point.source = uint16_t(i % 3);
    point.x = uint16_t(65535 - i);
    point.y = uint16_t(i);
    cloud.points.push_back(point);
  }
  return cloud;
}

TEST(CloudIo, RoundTripsEveryField) {
  const TempFolder folder;
  const SelectionCloud cloud = Sample();
  WriteCloud(folder / "c.ply", cloud);
  const SelectionCloud back = ReadCloud(folder / "c.ply");
  EXPECT_EQ(back.sources, cloud.sources);
  ASSERT_EQ(back.points.size(), cloud.points.size());
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const auto &a = cloud.points[i], &b = back.points[i];
    EXPECT_EQ(a.position, b.position);
    EXPECT_TRUE(a.normal.isApprox(b.normal, 1e-6f));  // normalised again on reading
    EXPECT_EQ(a.footprint, b.footprint);
    EXPECT_EQ(a.confidence, b.confidence);
    EXPECT_EQ(a.coverage, b.coverage);
    EXPECT_EQ(a.color, b.color);
    EXPECT_EQ(a.source, b.source);
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.y, b.y);
  }
  WriteCloud(folder / "d.ply", back);
  EXPECT_EQ(ReadFile(folder / "c.ply"), ReadFile(folder / "d.ply"));
}

TEST(CloudIo, NamesTheFieldsInItsHeader) {
  const TempFolder folder;
  WriteCloud(folder / "c.ply", Sample());
  const std::string bytes = ReadFile(folder / "c.ply");
  EXPECT_THAT(bytes, HasSubstr("format binary_little_endian 1.0\n"));
  EXPECT_THAT(bytes, HasSubstr("comment source two words/ü.png\n"));
  EXPECT_THAT(bytes, HasSubstr("element vertex 5\nproperty float x\nproperty float y\n"));
  // 9 floats, 3 bytes, 3 shorts a point.
  const size_t body = bytes.size() - (bytes.find("end_header\n") + 11);
  EXPECT_EQ(body, 5u * 45u);
}

TEST(CloudIo, EmptyCloudRoundTrips) {
  const TempFolder folder;
  WriteCloud(folder / "c.ply", {});
  EXPECT_TRUE(ReadCloud(folder / "c.ply").points.empty());
}

TEST(CloudIo, ReadsForeignAsciiClouds) {
  const TempFolder folder;
  // Faces before the vertices, CRLF, an unknown property, no normals: a plane of points 0.5 apart.
  std::string text =
      "ply\r\nformat ascii 1.0\r\ncomment source is just a word\r\nelement face 2\r\n"
      "property list uchar int vertex_indices\r\nelement vertex 25\r\nproperty double x\r\n"
      "property double y\r\nproperty float z\r\nproperty uchar quality\r\nend_header\r\n"
      "3 0 1 2\r\n3 1 2 3\r\n";
  for (int i = 0; i < 25; ++i) {
    text += std::to_string(0.5 * (i % 5)) + " " + std::to_string(0.5 * (i / 5)) + " 2 7\r\n";
  }
  text.resize(text.size() - 2);  // no newline at the end
  WriteFile(folder / "a.ply", text);
  const auto cloud = ReadCloud(folder / "a.ply");
  ASSERT_EQ(cloud.points.size(), 25u);
  EXPECT_TRUE(cloud.sources.empty());
  EXPECT_EQ(cloud.points[7].position, Eigen::Vector3f(1.0f, 0.5f, 2));
  EXPECT_EQ(cloud.points[12].normal, Eigen::Vector3f::Zero());
  EXPECT_FLOAT_EQ(cloud.points[12].footprint, 0.5f);  // the spacing of an inner point
  EXPECT_FLOAT_EQ(cloud.points[12].coverage, 1);
}

TEST(CloudIo, ReadsBigEndianClouds) {
  const TempFolder folder;
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nproperty list uchar ushort junk\nproperty float ny\nend_header\n";
  const auto put = [&](float value) {
    const auto bits = std::bit_cast<uint32_t>(value);
    for (int shift = 24; shift >= 0; shift -= 8) bytes += char(bits >> shift);
  };
  put(1.5f), put(-2), put(3);
  bytes += std::string("\x02\x00\x01\x00\x02", 5);
  put(-4);
  WriteFile(folder / "b.ply", bytes);
  const auto cloud = ReadCloud(folder / "b.ply");
  ASSERT_EQ(cloud.points.size(), 1u);
  EXPECT_EQ(cloud.points[0].position, Eigen::Vector3f(1.5f, -2, 3));
  EXPECT_EQ(cloud.points[0].normal, Eigen::Vector3f(0, -1, 0));
}

class BadCloud : public ::testing::Test {
 protected:
  TempFolder folder;
  // The file's fault, as the user sees it.
  std::string Fault(const std::string& bytes) {
    WriteFile(folder / "bad.ply", bytes);
    try {
      ReadCloud(folder / "bad.ply");
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("bad.ply"));
      return error.what();
    }
    return "no error";
  }
  static std::string Ascii(const std::string& count, const std::string& body) {
    return "ply\nformat ascii 1.0\nelement vertex " + count +
           "\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + body;
  }
};

TEST_F(BadCloud, IsAnswered) {
  EXPECT_THAT(Fault(""), HasSubstr("not a PLY file"));
  EXPECT_THAT(Fault("not a ply\n"), HasSubstr("not a PLY file"));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\nelement vertex 3\n"), HasSubstr("no end_header line"));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\nend_header\n"), HasSubstr("holds no vertices"));
  EXPECT_THAT(Fault("ply\nformat utf9 1.0\nend_header\n"), HasSubstr("unknown PLY format utf9"));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n"),
              HasSubstr("bad.ply:3: expected \"element NAME COUNT\""));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\nproperty float x\nend_header\n"),
              HasSubstr("property before any element"));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n"),
              HasSubstr("unknown type \"quad\""));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
              HasSubstr("lack x, y or z"));
  EXPECT_THAT(Fault("ply\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
                    "end_header\n"),
              HasSubstr("no format line"));
  EXPECT_THAT(Fault(Ascii("2", "1 2 3\n4 x 6\n")), HasSubstr("bad.ply:9: not a number: x"));
  EXPECT_THAT(Fault(Ascii("2", "1 2 3\n4 5\n")), HasSubstr("value is missing"));
  EXPECT_THAT(Fault(Ascii("1", "1 nan 3\n")), HasSubstr("point 0: position is NaN"));
  EXPECT_THAT(Fault(Ascii("1", "1 1e99 3\n")), HasSubstr("point 0: position is NaN or infinite"));
  EXPECT_THAT(Fault("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                    "property float z\nproperty float red\nend_header\n1 2 3 nan\n"),
              HasSubstr("point 0: color is NaN"));
}

TEST_F(BadCloud, CountsBeyondTheFileTakeNoMemory) {
  EXPECT_THAT(Fault(Ascii("1000000000000", "1 2 3\n")), HasSubstr("truncated"));
  EXPECT_THAT(Fault(Ascii("18446744073709551615", "1 2 3\n")), HasSubstr("truncated"));
  WriteCloud(folder / "c.ply", Sample());
  const std::string bytes = ReadFile(folder / "c.ply");
  EXPECT_THAT(Fault(bytes.substr(0, bytes.size() - 1)), HasSubstr("truncated"));
  std::string list =
      "ply\nformat binary_little_endian 1.0\nelement junk 1\n"
      "property list uint int a\nelement vertex 0\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n";
  EXPECT_THAT(Fault(list + "\xff\xff\xff\xff"), HasSubstr("malformed list length"));
  EXPECT_THAT(Fault(list + std::string("\xff\xff\0\0", 4)), HasSubstr("truncated"));
}

TEST_F(BadCloud, SourceThatIsNotThere) {
  auto cloud = Sample();
  cloud.points[3].source = 3;
  WriteCloud(folder / "c.ply", cloud);
  EXPECT_THAT([&] { ReadCloud(folder / "c.ply"); },
              ThrowsMessage<InputError>(HasSubstr("point 3: names no source view")));
}

TEST_F(BadCloud, MissingOrAFolder) {
  EXPECT_THROW(ReadCloud(folder / "none.ply"), InputError);
  EXPECT_THROW(ReadCloud(folder.path()), InputError);
}

TEST(CloudIo, FailedWriteLeavesTheOldFile) {
  const TempFolder folder;
  WriteFile(folder / "file", "old");
  EXPECT_THROW(WriteCloud(folder.path() / "file" / "c.ply", Sample()), RunError);
  EXPECT_EQ(ReadFile(folder / "file"), "old");
}

}  // namespace
}  // namespace retint
