// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>

#include "base/error.h"
#include "tests/fuzz/targets.h"

namespace retint {

void RunTarget(const FuzzTarget& target, const std::filesystem::path& folder,
               std::string_view bytes) {
  std::ofstream(folder / target.file, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  try {
    target.read(folder);
  } catch (const Error& error) {
    // One line, whatever bytes it quotes.
    if (std::string_view(error.what()).find('\n') != std::string_view::npos) throw;
  }
}

}  // namespace retint
