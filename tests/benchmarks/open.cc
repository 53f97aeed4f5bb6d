// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_open: the time to open a splat file, compared with the time for its bytes: reading
// them from disk and, for packed files, unpacking them on one core with the same library. One JSON
// line. Each round does all of these once, so that they meet the same disturbances. It prints the
// least time of each. "cold": the system has dropped the file's pages before; "warm": they are in
// its memory.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/input_file.h"
#include "base/memory.h"
#include "splat_io/compression.h"
#include "splat_io/sog_files.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/main.h"

namespace retint {
namespace {

// Milliseconds that something took: of the clock, and of all processors together, which other
// programs disturb less. The least of several rounds.
struct Cost {
  double wall = std::numeric_limits<double>::infinity(), cpu = wall;

  // The result is freed after the clocks have stopped.
  template <typename Work>
  void Add(const Work& work) {
    ReleaseFreedMemory();
    const double cpu_before = CpuMilliseconds();
    const auto start = std::chrono::steady_clock::now();
    [[maybe_unused]] const auto result = work();
    const auto end = std::chrono::steady_clock::now();
    wall = std::min(wall, std::chrono::duration<double, std::milli>(end - start).count());
    cpu = std::min(cpu, CpuMilliseconds() - cpu_before);
  }

 private:
  static double CpuMilliseconds() {
    timespec used{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return double(used.tv_sec) * 1e3 + double(used.tv_nsec) / 1e6;
  }
};

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

// The bytes after unpacking; 0 if the file is not packed.
size_t Unpack(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".spz") {
    const std::string bytes = ReadBytes(path);
    constexpr char kGzip[] = {'\x1f', '\x8b'};
    if (bytes.compare(0, 2, kGzip, 2) != 0) return 0;
    const size_t most = MostUnpacked(bytes.size());
    UnsetVector<char> unpacked;
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

// Reads the file from its begin to its end, as `cat` does, into the same small memory.
size_t ReadThrough(const std::filesystem::path& path) {
  const InputFile file(path);
  std::vector<char> block(size_t{1} << 20);
  for (uint64_t at = 0; at < file.size(); at += block.size()) {
    file.ReadAt(at, block.data(), size_t(std::min<uint64_t>(block.size(), file.size() - at)));
  }
  return file.size();
}

// Has the system give up the pages of the file that it holds. False where it keeps some.
bool DropPages(const std::filesystem::path& path) {
  const InputFile file(path);
  fsync(file.descriptor());  // only written pages can be dropped
  posix_fadvise(file.descriptor(), 0, 0, POSIX_FADV_DONTNEED);
  void* const data = mmap(nullptr, file.size(), PROT_READ, MAP_SHARED, file.descriptor(), 0);
  if (data == MAP_FAILED) return false;
  const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
  std::vector<unsigned char> held((file.size() + page - 1) / page);
  const bool told = mincore(data, file.size(), held.data()) == 0;
  munmap(data, file.size());
  return told && std::none_of(held.begin(), held.end(), [](unsigned char h) { return h & 1; });
}

struct Costs {
  Cost disk, read, unpack, open_cold, open_warm;

  void Round(const std::filesystem::path& path) {
    const auto drop = [&] {
      if (!DropPages(path)) throw std::runtime_error("the system keeps the file in its memory");
    };
    drop();
    disk.Add([&] { return ReadThrough(path); });
    drop();
    open_cold.Add([&] { return ReadSplat(path); });
    open_warm.Add([&] { return ReadSplat(path); });
    read.Add([&] { return ReadThrough(path); });
    unpack.Add([&] { return Unpack(path); });
  }
};

int Main(int argc, char** argv) {
  std::filesystem::path path;
  int rounds = 5;
  CLI::App app("opens a splat file and times it; one JSON line");
  app.add_option("splat", path, "the file")->required();
  app.add_option("--rounds", rounds, "the best of so many counts")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  const double before = PeakMb();
  const size_t gaussians = ReadSplat(path).NumGaussians();
  const double peak = PeakMb() - before;
  const size_t unpacked = Unpack(path);
  Costs costs;
  for (int i = 0; i < rounds; ++i) costs.Round(path);
  std::printf(
      "{\"benchmark\": \"open\", \"file\": \"%s\", \"gaussians\": %zu, \"mb\": %.1f, "
      "\"disk_ms\": %.1f, \"read_ms\": %.1f, \"unpacked_mb\": %.1f, \"unpack_ms\": %.1f, "
      "\"open_cold_ms\": %.1f, \"open_warm_ms\": %.1f, \"open_cpu_ms\": %.1f, \"peak_mb\": %.0f}\n",
      path.filename().c_str(), gaussians, double(std::filesystem::file_size(path)) / (1 << 20),
      costs.disk.wall, costs.read.wall, double(unpacked) / (1 << 20),
      unpacked > 0 ? costs.unpack.wall : 0.0, costs.open_cold.wall, costs.open_warm.wall,
      costs.open_warm.cpu, peak);
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_bench_open", retint::Main, argc, argv);
}
