// SPDX-License-Identifier: BSD-3-Clause
#include "session/pictures/video.h"

#include <algorithm>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/session/saved_scene.h"

namespace retint {
namespace {

// Of one color, so that a JPEG changes it by little.
Image8 Plain(int width, int height, uint8_t level) {
  Image8 image(width, height);
  std::fill(image.data.begin(), image.data.end(), level);
  return image;
}

uint32_t NumberAt(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof(value));
  return value;
}

TEST(AviWriter, WritesWhatItsIndexSays) {
  const TempFolder folder;
  AviWriter writer(folder / "film.avi", 40, 30, 12.5);
  for (const uint8_t level : {20, 120, 220}) writer.Add(Plain(40, 30, level));
  writer.Commit();
  const std::string film = ReadFile(folder / "film.avi");
  EXPECT_EQ(film.substr(0, 4), "RIFF");
  EXPECT_EQ(NumberAt(film, 4) + 8, film.size());
  EXPECT_EQ(film.substr(8, 8), "AVI LIST");
  const size_t main = film.find("avih") + 8, stream = film.find("vidsMJPG");
  EXPECT_EQ(NumberAt(film, main), 80000u) << "microseconds a picture";
  EXPECT_EQ(NumberAt(film, main + 16), 3u);
  EXPECT_EQ(NumberAt(film, main + 32), 40u);
  EXPECT_EQ(NumberAt(film, main + 36), 30u);
  EXPECT_EQ(NumberAt(film, stream + 24), 12500u) << "per 1000 seconds";
  EXPECT_EQ(NumberAt(film, stream + 20), 1000u);
  const size_t movie = film.find("movi"), index = film.find("idx1");
  EXPECT_EQ(movie + NumberAt(film, movie - 4), index) << "the list ends where the index begins";
  ASSERT_EQ(NumberAt(film, index + 4), 3u * 16);
  for (size_t i = 0; i < 3; ++i) {
    const size_t entry = index + 8 + 16 * i;
    const size_t at = movie + NumberAt(film, entry + 8);
    ASSERT_EQ(film.substr(at, 4), "00dc") << i;
    ASSERT_EQ(NumberAt(film, at + 4), NumberAt(film, entry + 12));
    WriteFile(folder / "frame.jpg", film.substr(at + 8, NumberAt(film, at + 4)));
    const Image8 frame = ReadImage8(folder / "frame.jpg");
    ASSERT_EQ(frame.width, 40);
    // Rounding of the codec, which keeps one color to a level or two.
    EXPECT_NEAR(frame.data[300], 20 + 100 * int(i), 3);
  }
}

TEST(AviWriter, RefusesWhatItCannotHold) {
  const TempFolder folder;
  EXPECT_THROW(AviWriter(folder / "film.mp4", 40, 30, 24), OptionError);
  EXPECT_THROW(AviWriter(folder / "film.avi", 40, 30, 0), OptionError);
  EXPECT_THROW(AviWriter(folder / "film.avi", 0, 30, 24), OptionError);
  EXPECT_THROW(AviWriter(folder / "film.avi", 40, 30, 24, 101), OptionError);
  AviWriter writer(folder / "film.avi", 40, 30, 24);
  EXPECT_THROW(writer.Commit(), OptionError) << "no picture";
  EXPECT_THROW(writer.Add(Plain(30, 40, 0)), OptionError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(FilmOfFrames, TakesThemInTheirOrder) {
  const TempFolder folder;
  Monitor monitor;
  EXPECT_THROW(FilmOfFrames(folder.path(), folder / "film.avi", 30, monitor), InputError);
  for (int i = 0; i < 12; ++i) {
    char name[16];
    std::snprintf(name, sizeof(name), "%05d.png", i);
    WritePng(folder / name, Plain(16, 16, static_cast<uint8_t>(20 * i)));
  }
  WritePng(folder / "00013.png", Plain(16, 16, 0));  // beyond a gap: of another film
  FilmOfFrames(folder.path(), folder / "film.avi", 30, monitor);
  const std::string film = ReadFile(folder / "film.avi");
  EXPECT_EQ(NumberAt(film, film.find("avih") + 8 + 16), 12u);
  Monitor cancelled;
  cancelled.Cancel();
  EXPECT_THROW(FilmOfFrames(folder.path(), folder / "other.avi", 30, cancelled), Cancelled);
  EXPECT_FALSE(IsFile(folder / "other.avi"));
}

}  // namespace
}  // namespace retint
