// SPDX-License-Identifier: BSD-3-Clause
#include "out_of_core/splat_index.h"

#include <fcntl.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/checksum.h"
#include "base/error.h"
#include "base/files.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/random_scene.h"
#include "tests/support/data.h"
#include "tests/support/file_size_limit.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing::ThrowsMessage;

class SplatIndexTest : public testing::Test {
 protected:
  void Write(size_t count, unsigned seed = 1) {
    model_ = RandomScene(count, 0, seed);
    WriteSplat(splat_, model_);
  }
  // At once, without waiting for the disk.
  void Put(const std::string& bytes) const { std::ofstream(index_, std::ios::binary) << bytes; }
  std::vector<std::string> Entries() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  TempFolder folder_;
  fs::path splat_ = folder_ / "a.ply", index_ = folder_ / "a.ply.index";
  GaussianModel model_;
  Monitor monitor_;
};

void ExpectWhole(const SplatIndex& index, const GaussianModel& model, uint32_t most) {
  std::vector<uint32_t> all(index.blocks().size());
  std::iota(all.begin(), all.end(), 0U);
  std::vector<uint32_t> expected(model.NumGaussians());
  std::iota(expected.begin(), expected.end(), 0U);
  EXPECT_EQ(index.Records(all), expected);  // every record once
  for (const uint32_t b : all) {
    const IndexBlock& block = index.blocks()[b];
    EXPECT_LE(block.count, most);
    for (const uint32_t g : index.Records(std::span(&b, 1))) {
      const float* const s = &model.log_scales[3 * g];
      EXPECT_LE(std::exp(std::max({s[0], s[1], s[2]})), block.bounds.sigma);
      for (size_t i = 0; i < 3; ++i) {
        EXPECT_GE(model.means[3 * g + i], block.bounds.low[i]);
        EXPECT_LE(model.means[3 * g + i], block.bounds.high[i]);
      }
    }
  }
}

TEST_F(SplatIndexTest, HoldsEveryRecordOnceWithinItsBlocksBounds) {
  Write(20000);
  const PlyFile file(splat_);
  SplatIndexOptions options;
  options.block = 100;
  SplatIndex::Build(file, index_, options, monitor_);
  const SplatIndex index(index_, file);
  ExpectWhole(index, model_, 100);
  EXPECT_EQ(index.splat_xxh64(), ChecksumFile(splat_).xxh64);
  // Blocks are neighbors in space: a two-hundredth of the Gaussians of a cube of side 10, were they
  // a cube, would have a side of 1.7.
  double side = 0;
  for (const IndexBlock& block : index.blocks()) {
    for (size_t i = 0; i < 3; ++i) {
      side += double(block.bounds.high[i] - block.bounds.low[i]) /
              (3 * static_cast<double>(index.blocks().size()));
    }
  }
  EXPECT_LT(side, 4);
}

// Entries beyond the memory are sorted on disk.
TEST_F(SplatIndexTest, IsTheSameWhateverTheMemory) {
  Write(30000);
  const PlyFile file(splat_);
  SplatIndexOptions options;
  SplatIndex::Build(file, index_, options, monitor_);
  const std::string of_all = ReadFile(index_);
  options.memory_bytes = SplatIndex::LeastBytes(file, options);
  SplatIndex::Build(file, index_, options, monitor_);
  EXPECT_EQ(ReadFile(index_), of_all);
  ExpectWhole(SplatIndex(index_, file), model_, options.block);
  EXPECT_EQ(Entries(), (std::vector<std::string>{"a.ply", "a.ply.index"}));
}

// Names that appear in a folder, however briefly.
class NewNames {
 public:
  explicit NewNames(const fs::path& folder) : fd_(inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {
    watch_ = inotify_add_watch(fd_, folder.c_str(), IN_CREATE | IN_MOVED_TO);
  }
  ~NewNames() { close(fd_); }
  NewNames(const NewNames&) = delete;
  NewNames& operator=(const NewNames&) = delete;
  bool Works() const { return watch_ >= 0; }
  // Since the last call.
  std::vector<std::string> Take() const {
    std::vector<std::string> names;
    alignas(inotify_event) std::array<char, 4096> bytes;
    ssize_t got = 0;
    while ((got = read(fd_, bytes.data(), bytes.size())) > 0) {
      for (ssize_t at = 0; at < got;) {
        const auto* event = reinterpret_cast<const inotify_event*>(&bytes[static_cast<size_t>(at)]);
        names.emplace_back(event->name);
        at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      }
    }
    return names;
  }

 private:
  int fd_ = -1, watch_ = -1;
};

// A process that is killed leaves nothing, for the file never had a name.
TEST_F(SplatIndexTest, SortsInAFileWithoutAName) {
#ifndef O_TMPFILE
  GTEST_SKIP() << "needs O_TMPFILE";
#else
  const int fd = open(folder_.path().c_str(), O_TMPFILE | O_RDWR | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) GTEST_SKIP() << "the file system has no files without a name";
  close(fd);
  Write(30000);
  const PlyFile file(splat_);
  const NewNames names(folder_.path());
  if (!names.Works()) GTEST_SKIP() << "needs inotify";
  SplatIndexOptions options;
  options.memory_bytes = SplatIndex::LeastBytes(file, options);
  SplatIndex::Build(file, index_, options, monitor_);
  const std::vector<std::string> seen = names.Take();
  EXPECT_THAT(seen, Contains("a.ply.index"));
  EXPECT_THAT(seen, Not(Contains(StartsWith(".retint-index-"))));
  // Its entries went into a file: without files, they cannot be sorted.
  const FileSizeLimit limit(10'000);
  EXPECT_THAT([&] { SplatIndex::Build(file, index_, options, monitor_); },
              ThrowsMessage<RunError>(HasSubstr("temporary file")));
#endif
}

// Entries of 32 bytes are sorted: 3.2 MB of them, in a memory that is not so large beside the
// 3 MiB that every build takes.
TEST_F(SplatIndexTest, WhatItTakesAtLeastGrowsMuchSlowerThanTheFile) {
  SplatIndexOptions options;
  const auto least = [&](size_t count) {
    Write(count);
    return SplatIndex::LeastBytes(PlyFile(splat_), options);
  };
  const size_t of_few = least(1000), of_many = least(100'000);
  EXPECT_LT(of_few, of_many);
  EXPECT_LT(of_many - of_few, size_t{1} << 20);
}

// Gaussians in one place have no order along the curve but that of their records.
TEST_F(SplatIndexTest, SortsAnyNumberInOnePlace) {
  Write(30000);
  for (size_t i = 0; i < model_.means.size(); ++i) model_.means[i] = model_.means[i % 3];
  std::fill(model_.log_scales.begin(), model_.log_scales.end(), -3.0F);
  WriteSplat(splat_, model_);
  const PlyFile file(splat_);
  SplatIndexOptions options;
  options.memory_bytes = SplatIndex::LeastBytes(file, options);
  SplatIndex::Build(file, index_, options, monitor_);
  const SplatIndex index(index_, file);
  ExpectWhole(index, model_, options.block);
  EXPECT_EQ(index.blocks().size(), 59U);  // all full but the last
}

TEST_F(SplatIndexTest, RefusesTooLittleMemoryBeforeItBegins) {
  Write(3000);
  const PlyFile file(splat_);
  SplatIndexOptions options;
  options.memory_bytes = SplatIndex::LeastBytes(file, options) / 2;
  size_t least = 0;
  try {
    SplatIndex::Build(file, index_, options, monitor_);
  } catch (const IndexMemoryError& error) {
    least = error.least_bytes();
    EXPECT_THAT(error.what(), HasSubstr("3000 Gaussians"));
  }
  EXPECT_EQ(Entries(), std::vector<std::string>{"a.ply"});
  options.memory_bytes = least;
  SplatIndex::Build(file, index_, options, monitor_);
  ExpectWhole(SplatIndex(index_, file), model_, options.block);
}

TEST_F(SplatIndexTest, FindsWhatViewsSeeAndABoxHolds) {
  Write(5000);
  const PlyFile file(splat_);
  SplatIndexOptions options;
  options.block = 50;
  SplatIndex::Build(file, index_, options, monitor_);
  const SplatIndex index(index_, file);
  const Eigen::AlignedBox3f box(Eigen::Vector3f(1, 1, 1), Eigen::Vector3f(2, 2, 2));
  const std::vector<uint32_t> blocks = index.Visible({}, box);
  EXPECT_LT(blocks.size(), index.blocks().size() / 2);
  const std::vector<uint32_t> records = index.Records(blocks);
  EXPECT_EQ(records.size(), index.CountOf(blocks));
  int inside = 0;
  for (uint32_t g = 0; g < model_.NumGaussians(); ++g) {
    if (!box.contains(Eigen::Vector3f(&model_.means[3 * size_t{g}]))) continue;
    ++inside;
    EXPECT_TRUE(std::binary_search(records.begin(), records.end(), g));
  }
  EXPECT_GT(inside, 0);
  // And the other way around.
  const std::vector<uint32_t> some = {7, 300, 4999};
  const std::vector<uint32_t> holding = index.Holding(some);
  EXPECT_LE(holding.size(), some.size());
  const std::vector<uint32_t> held = index.Records(holding);
  EXPECT_TRUE(std::includes(held.begin(), held.end(), some.begin(), some.end()));
  for (const uint32_t block : holding) {
    const std::vector<uint32_t> members = index.Records(std::span(&block, 1));
    EXPECT_TRUE(std::any_of(some.begin(), some.end(), [&](uint32_t record) {
      return std::binary_search(members.begin(), members.end(), record);
    }));
  }
  EXPECT_THAT(index.Holding({}), testing::IsEmpty());
  CameraParams camera{};
  camera.fx = camera.fy = 64;
  camera.cx = camera.cy = 32;
  camera.width = camera.height = 64;
  camera.rotation[0] = camera.rotation[4] = camera.rotation[8] = 1;
  camera.translation[2] = 1000;  // all of the scene lies ahead
  EXPECT_EQ(index.CountOf(index.Visible(std::vector{Frustum(camera)})), 5000U);
  camera.translation[2] = -1000;  // and behind
  EXPECT_EQ(index.CountOf(index.Visible(std::vector{Frustum(camera)})), 0U);
}

// A copy whose colors alone differ has its blocks where the original has them.
TEST_F(SplatIndexTest, ServesACopyWithOtherColors) {
  Write(3000);
  const PlyFile file(splat_);
  SplatIndex::Build(file, index_, {}, monitor_);
  const SplatIndex index(index_, file);
  const fs::path copy = folder_ / "copy.ply", copys = SplatIndex::PathFor(copy);
  const std::vector<uint32_t> changed = {5};
  file.WritePatched(copy, changed, std::vector<float>{1, 2, 3}, monitor_);
  fs::last_write_time(copy, fs::last_write_time(splat_) + std::chrono::seconds(1));
  const PlyFile opened(copy);
  index.WriteFor(opened, copys);
  std::string built;
  const SplatIndex of_copy = SplatIndex::OpenOrBuild(opened, copys, {}, monitor_, &built);
  EXPECT_EQ(built, "");
  ExpectWhole(of_copy, model_, 512);
  EXPECT_EQ(of_copy.splat_xxh64(), 0U);
  EXPECT_THAT([&] { SplatIndex(copys, file); },
              ThrowsMessage<InputError>(HasSubstr("was written after its index")));
  EXPECT_TRUE(SplatIndex::IsReplaceable(copys));
  EXPECT_TRUE(SplatIndex::IsReplaceable(folder_ / "nothing"));
  EXPECT_FALSE(SplatIndex::IsReplaceable(copy));
  // Bytes behind the splat are no part of it.
  const std::string written = ReadFile(copy);
  std::ofstream(splat_, std::ios::app) << "xyz";
  const PlyFile longer(splat_);
  SplatIndex::Build(longer, index_, {}, monitor_);
  longer.WritePatched(copy, changed, std::vector<float>{1, 2, 3}, monitor_);
  EXPECT_TRUE(ReadFile(copy) == written);
  const PlyFile again(copy);
  SplatIndex(index_, longer).WriteFor(again, copys);
  ExpectWhole(SplatIndex(copys, again), model_, 512);
  Write(3001);
  EXPECT_THAT([&] { index.WriteFor(PlyFile(splat_), copys); },
              ThrowsMessage<OptionError>(HasSubstr("is no copy")));
}

TEST_F(SplatIndexTest, IsRebuiltWhereItDoesNotFit) {
  Write(500);
  std::string built;
  const auto open = [&] {
    const PlyFile file(splat_);
    ExpectWhole(SplatIndex::OpenOrBuild(file, index_, {}, monitor_, &built), model_, 512);
    return std::exchange(built, "");
  };
  EXPECT_THAT(open(), HasSubstr("there was no"));
  EXPECT_EQ(open(), "");
  Write(501);
  EXPECT_THAT(open(), HasSubstr("is the index of another file"));
  Write(501, 2);  // of the same length
  fs::last_write_time(splat_, fs::last_write_time(splat_) + std::chrono::seconds(1));
  EXPECT_THAT(open(), HasSubstr("was written after its index"));
  WriteFile(index_, ReadFile(index_).substr(0, 5));
  EXPECT_THAT(open(), HasSubstr("truncated"));
  EXPECT_EQ(open(), "");
}

TEST_F(SplatIndexTest, NeverReplacesWhatIsNoIndex) {
  Write(24);
  const PlyFile file(splat_);
  std::string built;
  for (const std::string text :
       {"a note",
        "no index at all, but some text that is longer than the header of one, which is "
        "ninety-six bytes long"}) {
    WriteFile(index_, text);
    EXPECT_THROW(SplatIndex::OpenOrBuild(file, index_, {}, monitor_, &built), InputError);
    EXPECT_THROW(SplatIndex::Build(file, index_, {}, monitor_), InputError);
    EXPECT_EQ(ReadFile(index_), text);
  }
  // The splat itself, too.
  const std::string bytes = ReadFile(splat_);
  EXPECT_THROW(SplatIndex::Build(file, splat_, {}, monitor_), InputError);
  EXPECT_EQ(ReadFile(splat_), bytes);
}

TEST_F(SplatIndexTest, RefusesEveryTruncationAndEveryDamagedByte) {
  Write(24);
  const PlyFile file(splat_);
  SplatIndexOptions options;
  options.block = 12;
  SplatIndex::Build(file, index_, options, monitor_);
  const std::string bytes = ReadFile(index_);
  const auto use = [&] {
    const SplatIndex index(index_, file);
    std::vector<uint32_t> all(index.blocks().size());
    std::iota(all.begin(), all.end(), 0U);
    index.Records(all);
  };
  for (size_t size = 0; size < bytes.size(); ++size) {
    Put(bytes.substr(0, size));
    EXPECT_THROW(use(), InputError) << size;
  }
  for (size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    Put(damaged);
    EXPECT_THROW(use(), InputError) << at;
  }
  WriteFile(index_, bytes);
  use();
}

TEST_F(SplatIndexTest, AFullDiskLosesNothing) {
  Write(20000);
  const PlyFile file(splat_);
  SplatIndex::Build(file, index_, {}, monitor_);
  const std::string before = ReadFile(index_);
  {
    const FileSizeLimit limit(10'000);  // of the index's 30,000 bytes or so
    EXPECT_THROW(SplatIndex::Build(file, index_, {}, monitor_), RunError);
    SplatIndexOptions options;
    options.memory_bytes = SplatIndex::LeastBytes(file, options);
    // The temporary file does not fit.
    EXPECT_THROW(SplatIndex::Build(file, index_, options, monitor_), RunError);
    // Nor does a copy's index.
    EXPECT_THROW(SplatIndex(index_, file).WriteFor(file, folder_ / "copy.index"), RunError);
  }
  EXPECT_EQ(ReadFile(index_), before);
  EXPECT_EQ(Entries(), (std::vector<std::string>{"a.ply", "a.ply.index"}));
}

TEST_F(SplatIndexTest, RefusesWhatTheWholeFileWouldBeRefusedFor) {
  Write(5000);
  // The last float of record 3000.
  std::string bytes = ReadFile(splat_);
  const PlyFile whole(splat_);
  const float bad = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(&bytes[whole.first_byte() + 3001 * whole.record_bytes() - 4], &bad, 4);
  WriteFile(splat_, bytes);
  const PlyFile file(splat_);
  EXPECT_THAT([&] { SplatIndex::Build(file, index_, {}, monitor_); },
              ThrowsMessage<InputError>(HasSubstr("Gaussian 3000: rot_3 is NaN")));
  EXPECT_FALSE(fs::exists(index_));
}

TEST_F(SplatIndexTest, NoticesThatTheFileChangesMeanwhile) {
  Write(5000);
  const PlyFile file(splat_);
  Monitor meddler([&](const Progress& progress) {
    if (progress.fraction > 0)
      fs::last_write_time(splat_, fs::file_time_type::clock::now() + std::chrono::hours(1));
  });
  EXPECT_THAT([&] { SplatIndex::Build(file, index_, {}, meddler); },
              ThrowsMessage<InputError>(HasSubstr("changed while it was in use")));
  EXPECT_FALSE(fs::exists(index_));
}

}  // namespace
}  // namespace retint
