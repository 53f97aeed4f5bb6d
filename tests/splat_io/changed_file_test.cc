// SPDX-License-Identifier: BSD-3-Clause
// Files that another program cuts off or changes while they are read: a line that names them, or
// the scene as it was, never something else.
#include <fcntl.h>
#include <unistd.h>

#include <gmock/gmock.h>

#include "base/files.h"
#include "base/monitor.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

constexpr const char* kNames[] = {"a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog",
                                  "a.glb"};

// Does something to the file once a part of it was read.
class Meddler : public Monitor {
 public:
  explicit Meddler(std::function<void()> meddle)
      : Monitor([this](const Progress&) {
          if (steps_++ == 1) meddle_();
        }),
        meddle_(std::move(meddle)) {}
  int steps() const { return steps_; }

 private:
  int steps_ = 0;
  std::function<void()> meddle_;
};

class ChangedFile : public testing::TestWithParam<const char*> {
 protected:
  ChangedFile() : path_(folder_ / GetParam()) {
    WriteSplat(path_, RandomScene(40000, 1));
    whole_ = ReadSplat(path_);
  }

  // The message, or "" where the scene was read as it was.
  std::string ReadMeanwhile(std::function<void()> meddle) {
    Meddler meddler(std::move(meddle));
    std::string message;
    try {
      const GaussianModel model = ReadSplat(path_, meddler);
      EXPECT_EQ(model.means, whole_.means);
      EXPECT_EQ(model.sh, whole_.sh);
    } catch (const InputError& error) {
      message = error.what();
      EXPECT_THAT(message, testing::HasSubstr(path_.string()));
      EXPECT_THAT(message, testing::Not(testing::HasSubstr("\n")));
    }
    EXPECT_GT(meddler.steps(), 1) << "nothing happened on the way";
    return message;
  }

  TempFolder folder_;
  std::filesystem::path path_;
  GaussianModel whole_;
};

TEST_P(ChangedFile, CutOffWhileItIsRead) {
  const auto half = std::filesystem::file_size(path_) / 2;
  ReadMeanwhile([&] { std::filesystem::resize_file(path_, half); });
}

TEST_P(ChangedFile, EmptiedWhileItIsRead) {
  ReadMeanwhile([&] { std::filesystem::resize_file(path_, 0); });
}

TEST_P(ChangedFile, RemovedOrReplacedWhileItIsRead) {
  ReadMeanwhile([&] { std::filesystem::remove(path_); });
  WriteSplat(path_, whole_);
  whole_ = ReadSplat(path_);
  // A new file of that name, as from an atomic save: the open file stays the old one.
  EXPECT_EQ(ReadMeanwhile([&] { WriteFile(path_, "something else"); }), "");
}

INSTANTIATE_TEST_SUITE_P(Formats, ChangedFile, testing::ValuesIn(kNames), [](const auto& one) {
  std::string name = one.param;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

// Blocks of a .ply that was cut off are read until they end.
TEST(ChangedPly, SaysWhereItEnds) {
  TempFolder folder;
  WriteSplat(folder / "a.ply", RandomScene(40000, 1));
  Meddler meddler([&] { std::filesystem::resize_file(folder / "a.ply", 300000); });
  EXPECT_THAT(MessageOf<InputError>([&] { ReadSplat(folder / "a.ply", meddler); }),
              testing::HasSubstr("truncated: ends at byte"));
}

}  // namespace
}  // namespace retint
