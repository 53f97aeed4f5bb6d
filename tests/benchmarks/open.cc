// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_open: how long a splat file takes to open, against the time that only its bytes
// take, read and, where they are packed, unpacked by the same library. One JSON line. The file is
// in the system's memory when the clocks start.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/memory.h"
#include "splat_io/compression.h"
#include "splat_io/input_file.h"
#include "splat_io/sog_files.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/main.h"

namespace retint {
namespace {

double Milliseconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

double PeakMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / 1024;
}

std::string ReadBytes(const std::filesystem::path& path) {
  const InputFile file(path);
  std::string bytes(file.size(), '\0');
  file.ReadAt(0, bytes.data(), bytes.size());
  return bytes;
}

// What comes out of the file's own compression; 0 where there is none.
size_t Unpack(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".spz") {
    const std::string bytes = ReadBytes(path);
    constexpr char kGzip[] = {'\x1f', '\x8b'};
    if (bytes.compare(0, 2, kGzip, 2) != 0) return 0;
    const size_t most = MostUnpacked(bytes.size());
    std::vector<char> unpacked;
    Gunzip(
        bytes, 1, [&](std::string_view) { return most; }, [](size_t) {}, unpacked);
    return unpacked.size();
  }
  if (extension != ".sog") return 0;
  const auto files = SogFiles::Open(path);
  size_t unpacked = 0;
  for (const char* name :
       {"means_l", "means_u", "scales", "quats", "sh0", "shN_centroids", "shN_labels"}) {
    const std::string picture = std::string(name) + ".webp";
    try {
      constexpr uint64_t kMostPixels = uint64_t{1} << 28;
      unpacked += DecodeWebp(files->Read(picture), 1, kMostPixels, path, picture).rgba.size();
    } catch (const std::exception&) {  // without higher bands there are no such pictures
      if (picture.compare(0, 3, "shN") != 0) throw;
    }
  }
  return unpacked;
}

double Best(int rounds, const std::function<void()>& work) {
  double best = Milliseconds(work);
  for (int i = 1; i < rounds; ++i) {
    ReleaseFreedMemory();
    best = std::min(best, Milliseconds(work));
  }
  return best;
}

int Main(int argc, char** argv) {
  std::filesystem::path path;
  int rounds = 3;
  CLI::App app("opens a splat file and times it; one JSON line");
  app.add_option("splat", path, "the file")->required();
  app.add_option("--rounds", rounds, "the best of so many counts")->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);
  const double before = PeakMb();
  size_t gaussians = 0;
  const double first = Milliseconds([&] { gaussians = ReadSplat(path).NumGaussians(); });
  const double peak = PeakMb() - before;
  const double open = std::min(first, Best(rounds, [&] { ReadSplat(path); }));
  const double read = Best(rounds, [&] { ReadBytes(path); });
  size_t unpacked = 0;
  const double unpack = Best(rounds, [&] { unpacked = Unpack(path); });
  std::printf(
      "{\"benchmark\": \"open\", \"file\": \"%s\", \"gaussians\": %zu, \"mb\": %.1f, "
      "\"read_ms\": %.1f, \"unpacked_mb\": %.1f, \"unpack_ms\": %.1f, \"open_ms\": %.1f, "
      "\"peak_mb\": %.0f}\n",
      path.filename().c_str(), gaussians, double(std::filesystem::file_size(path)) / (1 << 20),
      read, double(unpacked) / (1 << 20), unpacked > 0 ? unpack : 0.0, open, peak);
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_bench_open", retint::Main, argc, argv);
}
