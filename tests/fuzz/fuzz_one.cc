// SPDX-License-Identifier: BSD-3-Clause
// One target for libFuzzer. `fuzz_NAME --seeds FOLDER` writes its seeds; everything else on the
// command line is libFuzzer's.
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>

#include "base/files.h"
#include "tests/fuzz/targets.h"

namespace {

namespace fs = std::filesystem;

const retint::FuzzTarget& Target() {
  for (const retint::FuzzTarget& target : retint::RETINT_FUZZ_GROUP()) {
    if (std::strcmp(target.name, RETINT_FUZZ_TARGET) == 0) return target;
  }
  throw std::runtime_error("there is no target " RETINT_FUZZ_TARGET);
}

// Removed at the end.
struct Folder {
  Folder() {
    path = (fs::temp_directory_path() / "retint-fuzz-XXXXXX").string();
    if (!mkdtemp(path.data())) std::abort();
    if (Target().prepare) Target().prepare(path);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  std::string path;
};

void WriteSeeds(const fs::path& folder) {
  std::vector<std::string> seeds = Target().seeds();
  if (const char* data = std::getenv("RETINT_DATA")) {
    for (const char* name : Target().data) {
      if (retint::IsFile(fs::path(data) / name)) {
        seeds.push_back(retint::ReadFile(fs::path(data) / name));
      }
    }
  }
  for (size_t i = 0; i < seeds.size(); ++i) {
    retint::WriteFile(folder / ("seed" + std::to_string(i)), seeds[i]);
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  if (*count == 3 && std::strcmp((*arguments)[1], "--seeds") == 0) {
    WriteSeeds((*arguments)[2]);
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const Folder folder;
  retint::RunTarget(Target(), folder.path, {reinterpret_cast<const char*>(data), size});
  return 0;
}
