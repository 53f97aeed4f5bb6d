// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/ply_file.h"

#include <chrono>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "scene/sh_band4.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/random_scene.h"
#include "tests/support/data.h"
#include "tests/support/file_size_limit.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

class PlyFileTest : public testing::Test {
 protected:
  // Every record that is a multiple of three or lies far behind the others.
  static std::vector<uint32_t> SomeOf(size_t count) {
    std::vector<uint32_t> records;
    for (uint32_t g = 0; g < count / 2; g += 3) records.push_back(g);
    records.push_back(static_cast<uint32_t>(count - 1));
    return records;
  }

  TempFolder folder_;
  fs::path splat_ = folder_ / "a.ply", copy_ = folder_ / "b.ply";
  Monitor monitor_;
};

TEST_F(PlyFileTest, ReadsRecordsAsTheWholeFileHasThem) {
  const GaussianModel whole = RandomScene(3000, 2);
  WriteSplat(splat_, whole);
  const PlyFile file(splat_);
  EXPECT_EQ(file.count(), 3000U);
  EXPECT_EQ(file.sh_degree(), 2);
  const std::vector<uint32_t> records = SomeOf(3000);
  const GaussianModel part = file.Read(records, monitor_);
  part.Validate();
  ASSERT_EQ(part.NumGaussians(), records.size());
  for (size_t i = 0; i < records.size(); ++i) {
    const size_t g = records[i];
    EXPECT_TRUE(std::equal(&part.means[3 * i], &part.means[3 * i] + 3, &whole.means[3 * g]));
    EXPECT_TRUE(std::equal(&part.sh[27 * i], &part.sh[27 * i] + 27, &whole.sh[27 * g]));
    EXPECT_EQ(part.opacity_logits[i], whole.opacity_logits[g]);
    EXPECT_EQ(part.quats_wxyz[4 * i + 3], whole.quats_wxyz[4 * g + 3]);
    EXPECT_EQ(part.log_scales[3 * i + 2], whole.log_scales[3 * g + 2]);
  }
}

// The same bytes as when the whole is edited and written.
TEST_F(PlyFileTest, PatchesACopyAsTheWholeIsWritten) {
  for (const int degree : {0, 3, 4}) {
    SCOPED_TRACE(degree);
    GaussianModel whole = RandomScene(2000, std::min(degree, 3));
    if (degree == 4) {
      ShBand4Columns::AddTo(whole);
      ShBand4 band{};
      band.fill(0.25F);
      for (size_t g = 0; g < 2000; ++g) ShBand4Columns(whole).Set(g, band);
    }
    WriteSplat(splat_, whole);
    const std::vector<uint32_t> records = SomeOf(2000);
    const size_t block = static_cast<size_t>(whole.NumShCoeffs()) * 3;
    std::vector<float> sh(records.size() * block);
    for (size_t i = 0; i < sh.size(); ++i) sh[i] = 0.001F * static_cast<float>(i % 777);
    const PlyFile file(splat_);
    file.WritePatched(copy_, records, sh, monitor_);
    for (size_t i = 0; i < records.size(); ++i) {
      std::copy_n(&sh[i * block], block, &whole.sh[records[i] * block]);
      if (degree == 4) ShBand4Columns(whole).Set(records[i], {});
    }
    WriteSplat(folder_ / "whole.ply", whole);
    EXPECT_EQ(ReadFile(copy_), ReadFile(folder_ / "whole.ply"));
    // Over itself, too.
    file.WritePatched(splat_, records, sh, monitor_);
    EXPECT_EQ(ReadFile(splat_), ReadFile(folder_ / "whole.ply"));
  }
}

TEST_F(PlyFileTest, KeepsDoublesAndWhatItDoesNotKnow) {
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment mine\nelement vertex 2\n";
  for (const char* column : {"x", "y", "z", "f_dc_1", "f_dc_0", "f_dc_2", "opacity", "scale_0",
                             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    text += std::string("property ") + (column == std::string("f_dc_1") ? "double " : "float ") +
            column + "\n";
  }
  text += "property uchar label\nelement other 1\nproperty uchar a\nend_header\n";
  const size_t body = text.size();
  const size_t record = 13 * 4 + 8 + 1;
  text.resize(body + 2 * record + 1, '\1');
  for (size_t g = 0; g < 2; ++g) std::memset(&text[body + g * record], 0, record - 1);
  WriteFile(splat_, text);
  const PlyFile file(splat_);
  EXPECT_EQ(file.record_bytes(), record);
  file.WritePatched(copy_, std::vector<uint32_t>{1}, std::vector<float>{0.5F, 0.25F, 2}, monitor_);
  std::string expected = text;
  const double green = 0.25;
  const float red = 0.5F, blue = 2;
  std::memcpy(&expected[body + record + 12], &green, 8);
  std::memcpy(&expected[body + record + 20], &red, 4);
  std::memcpy(&expected[body + record + 24], &blue, 4);
  EXPECT_EQ(ReadFile(copy_), expected);
}

TEST_F(PlyFileTest, NoticesThatTheFileChanged) {
  WriteSplat(splat_, RandomScene(1000, 1));
  const std::vector<float> sh(12, 0.5F);
  const std::vector<uint32_t> records = {7};
  const auto write = [&](const PlyFile& file) { file.WritePatched(copy_, records, sh, monitor_); };
  const auto changed = ThrowsMessage<InputError>(
      testing::AllOf(HasSubstr(splat_.string()), HasSubstr("changed while it was in use")));
  {
    const PlyFile file(splat_);
    fs::last_write_time(splat_, fs::last_write_time(splat_) + std::chrono::seconds(5));
    EXPECT_THAT([&] { write(file); }, changed);
  }
  {
    const PlyFile file(splat_);
    const auto time = fs::last_write_time(splat_);
    WriteSplat(splat_, RandomScene(1000, 1, 2));  // another file of that name, length and time
    fs::last_write_time(splat_, time);
    EXPECT_THAT([&] { write(file); }, changed);
  }
  {
    const PlyFile file(splat_);
    fs::resize_file(splat_, 5000);  // under the mapping
    EXPECT_THROW(file.Read(std::vector<uint32_t>{999}, monitor_), InputError);
    EXPECT_THAT([&] { write(file); }, changed);
  }
  {
    WriteSplat(splat_, RandomScene(1000, 1));
    const PlyFile file(splat_);
    fs::remove(splat_);
    EXPECT_THAT([&] { write(file); }, changed);
  }
  EXPECT_FALSE(fs::exists(copy_));
}

TEST_F(PlyFileTest, AFullDiskLeavesWhatWasThere) {
  WriteSplat(splat_, RandomScene(1000, 1));
  WriteFile(copy_, "what was there");
  const PlyFile file(splat_);
  {
    const FileSizeLimit limit(10'000);
    EXPECT_THROW(
        file.WritePatched(copy_, std::vector<uint32_t>{7}, std::vector<float>(12), monitor_),
        RunError);
  }
  EXPECT_EQ(ReadFile(copy_), "what was there");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()), 2);
}

TEST_F(PlyFileTest, RefusesRecordsThatAreNotOfOneSize) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 1\n";
  for (const char* column : {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0",
                             "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) {
    text += std::string("property float ") + column + "\n";
  }
  WriteFile(splat_, text + "end_header\n0 0 0 0 0 0 0 0 0 0 1 0 0 0\n");
  EXPECT_THAT([&] { PlyFile file(splat_); },
              ThrowsMessage<InputError>(HasSubstr("records are not of one size")));
}

}  // namespace
}  // namespace retint
