// SPDX-License-Identifier: BSD-3-Clause
// Internal to out_of_core: the index's entries of Gaussians, in the order of a curve through the
// scene, however many there are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace retint {

struct IndexEntry {
  std::array<float, 3> mean;
  float sigma;
  uint32_t record;
};
static_assert(sizeof(IndexEntry) == 20);

// An entry and its place on the curve.
struct PlacedEntry {
  uint64_t code;
  IndexEntry entry;
  bool operator<(const PlacedEntry& other) const {
    return code != other.code ? code < other.code : entry.record < other.entry.record;
  }
};

// A Morton curve for each class of size: one large Gaussian among small ones would make their
// block's bounds as large as its own. The grid spans the bulk of a sample; Gaussians beyond are put
// on its border, which makes blocks looser there, never wrong.
class MortonCurve {
 public:
  static constexpr int kSizeClasses = 4;

  explicit MortonCurve(const std::vector<IndexEntry>& sample);
  uint64_t CodeOf(const IndexEntry& entry) const;
  static uint64_t SizeClass(uint64_t code) { return code >> 60; }

 private:
  std::array<double, 3> origin_{};
  double extent_ = 0, small_ = 0;
};

// External merge sort: entries are sorted some at a time. If not all of them fit, those sorted so
// far become a run in a file without a name, of 20 bytes an entry, and the runs are merged. The
// order is that of (code, record), and so does not depend on the memory. RunError when the file
// cannot be written.
class EntrySorter {
 public:
  // Sorts `capacity` entries at a time, 32 bytes each, as `parts` runs beside one another. The file
  // goes into the folder of `index`. Both outlive this.
  EntrySorter(const MortonCurve& curve, size_t capacity, size_t parts,
              const std::filesystem::path& index);
  ~EntrySorter();
  EntrySorter(const EntrySorter&) = delete;
  EntrySorter& operator=(const EntrySorter&) = delete;

  // Room for `count` more, at most the capacity, to be filled before the next call.
  std::span<PlacedEntry> Room(size_t count);

  // Hands all of them to `take`, in order; the last call. `buffer_bytes` are held of all runs
  // together where they lie in a file, and the entries' memory is given up before.
  void Merge(size_t buffer_bytes, const std::function<void(const PlacedEntry&)>& take);

 private:
  struct Run {
    uint64_t offset;
    size_t count;
  };
  class Source;

  std::vector<std::span<PlacedEntry>> SortHeld();
  void Spill();
  void Write(std::span<const PlacedEntry> sorted);
  void OpenFile();
  [[noreturn]] void Fail(const char* what) const;

  const MortonCurve& curve_;
  const std::filesystem::path& index_;
  size_t capacity_, parts_, held_ = 0;
  std::unique_ptr<PlacedEntry[]> entries_;  // [capacity], of which the first `held_` are filled
  std::vector<Run> runs_;
  int fd_ = -1;
  uint64_t end_ = 0;  // of the file
};

}  // namespace retint
