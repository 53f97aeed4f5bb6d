// SPDX-License-Identifier: BSD-3-Clause
#include "base/input_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include <gmock/gmock.h>

#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

constexpr size_t kBytes = size_t{8} << 20;

// The bytes of the file that the system has in its memory.
size_t BytesInMemory(const InputFile& file) {
  void* const data = mmap(nullptr, file.size(), PROT_READ, MAP_SHARED, file.descriptor(), 0);
  const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  std::vector<unsigned char> held(file.size() / page);
  EXPECT_EQ(mincore(data, file.size(), held.data()), 0);
  munmap(data, file.size());
  size_t pages = 0;
  for (const unsigned char one : held) pages += one & 1;
  return pages * page;
}

TEST(ReadAheadTest, BringsTheWholeFileIntoMemory) {
  TempFolder folder;
  WriteFile(folder / "a", std::string(kBytes, 'a'));
  const InputFile file(folder / "a");
  fsync(file.descriptor());
  posix_fadvise(file.descriptor(), 0, 0, POSIX_FADV_DONTNEED);
  if (BytesInMemory(file) > 0) GTEST_SKIP() << "this file system keeps all in memory";
  const ReadAhead ahead(folder / "a");
  // It takes milliseconds; the limit is for a machine that does much else.
  for (int i = 0; i < 6000 && BytesInMemory(file) < kBytes; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(BytesInMemory(file), kBytes);
}

TEST(ReadAheadTest, IsOnlyAHint) {
  TempFolder folder;
  EXPECT_NO_THROW(ReadAhead(folder / "missing"));
  EXPECT_NO_THROW(ReadAhead{folder.path()});
  WriteFile(folder / "a", std::string(kBytes, 'a'));
  {
    const ReadAhead ahead(folder / "a");
    std::filesystem::resize_file(folder / "a", 1);  // while it is read, it may be
  }
  EXPECT_EQ(ReadFile(folder / "a"), "a");
}

}  // namespace
}  // namespace retint
