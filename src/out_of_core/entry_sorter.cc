// SPDX-License-Identifier: BSD-3-Clause
#include "out_of_core/entry_sorter.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr size_t kWriteEntries = 4096;  // at a time

// Bits of a 20-bit integer, two apart.
uint64_t Spread(uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffffULL;
  x = (x | x << 16) & 0x1f0000ff0000ffULL;
  x = (x | x << 8) & 0x100f00f00f00f00fULL;
  x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
  return (x | x << 2) & 0x1249249249249249ULL;
}

}  // namespace

MortonCurve::MortonCurve(const std::vector<IndexEntry>& sample) {
  std::vector<float> values(sample.size());
  const auto quantile = [&](double q, auto value) {
    std::transform(sample.begin(), sample.end(), values.begin(), value);
    return Quantile(values, q);
  };
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto mean = [axis](const IndexEntry& entry) { return entry.mean[axis]; };
    const double low = double(quantile(0.005, mean)), high = double(quantile(0.995, mean));
    const double margin = 0.1 * (high - low);
    origin_[axis] = low - margin;
    extent_ = std::max(extent_, high - low + 2 * margin);
  }
  extent_ = std::max(extent_, 1e-30);
  small_ = double(quantile(0.9, [](const IndexEntry& entry) { return entry.sigma; }));
}

uint64_t MortonCurve::CodeOf(const IndexEntry& entry) const {
  uint64_t code = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double cell = (double(entry.mean[axis]) - origin_[axis]) / extent_ * 0x1p20;
    code |= Spread(static_cast<uint64_t>(std::clamp(cell, 0.0, 0x1p20 - 1))) << axis;
  }
  uint64_t size = 0;
  for (double limit = small_; double(entry.sigma) > limit && size + 1 < kSizeClasses; limit *= 4) {
    ++size;
  }
  return size << 60 | code;
}

// The rest of a sorted run, in memory or in the file, of which some entries are read ahead.
class EntrySorter::Source {
 public:
  explicit Source(std::span<const PlacedEntry> held) : left_(held) {}
  Source(const EntrySorter& sorter, const Run& run, size_t entries_at_once)
      : sorter_(&sorter),
        offset_(run.offset),
        unread_(run.count),
        ahead_(std::min(entries_at_once, run.count)) {
    Refill();
  }

  bool IsEmpty() const { return left_.empty(); }
  const PlacedEntry& First() const { return left_.front(); }
  void Pop() {
    left_ = left_.subspan(1);
    if (left_.empty() && unread_ > 0) Refill();
  }

 private:
  void Refill() {
    const size_t count = std::min(ahead_.size(), unread_);
    std::array<IndexEntry, 256> some;
    for (size_t done = 0; done < count;) {
      const size_t part = std::min(some.size(), count - done);
      Read(reinterpret_cast<char*>(some.data()), part * sizeof(IndexEntry));
      for (size_t i = 0; i < part; ++i) {
        ahead_[done + i] = {sorter_->curve_.CodeOf(some[i]), some[i]};
      }
      done += part;
    }
    unread_ -= count;
    left_ = std::span(ahead_).first(count);
  }

  void Read(char* to, size_t bytes) {
    while (bytes > 0) {
      const ssize_t got = pread(sorter_->fd_, to, bytes, static_cast<off_t>(offset_));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) sorter_->Fail("read");
      to += got;
      offset_ += static_cast<uint64_t>(got);
      bytes -= static_cast<size_t>(got);
    }
  }

  const EntrySorter* sorter_ = nullptr;
  uint64_t offset_ = 0;
  size_t unread_ = 0;
  std::vector<PlacedEntry> ahead_;
  std::span<const PlacedEntry> left_;
};

EntrySorter::EntrySorter(const MortonCurve& curve, size_t capacity, size_t parts,
                         const fs::path& index)
    : curve_(curve), index_(index), capacity_(capacity), parts_(parts) {}

EntrySorter::~EntrySorter() {
  if (fd_ >= 0) close(fd_);
}

std::span<PlacedEntry> EntrySorter::Room(size_t count) {
  if (held_ + count > capacity_) Spill();
  if (!entries_) entries_ = std::make_unique_for_overwrite<PlacedEntry[]>(capacity_);
  held_ += count;
  return {entries_.get() + held_ - count, count};
}

std::vector<std::span<PlacedEntry>> EntrySorter::SortHeld() {
  std::vector<std::span<PlacedEntry>> sorted(parts_);
  ParallelTasks(static_cast<int64_t>(parts_), [&](int64_t task) {
    const auto part = static_cast<size_t>(task);
    const size_t begin = held_ * part / parts_, end = held_ * (part + 1) / parts_;
    sorted[part] = {entries_.get() + begin, end - begin};
    std::sort(sorted[part].begin(), sorted[part].end());
  });
  return sorted;
}

void EntrySorter::Spill() {
  OpenFile();
  for (const std::span<PlacedEntry> sorted : SortHeld()) {
    if (sorted.empty()) continue;
    runs_.push_back({end_, sorted.size()});
    Write(sorted);
  }
  held_ = 0;
}

void EntrySorter::Write(std::span<const PlacedEntry> sorted) {
  std::vector<IndexEntry> some;
  for (size_t first = 0; first < sorted.size(); first += some.size()) {
    some.clear();
    for (size_t i = first; i < std::min(sorted.size(), first + kWriteEntries); ++i) {
      some.push_back(sorted[i].entry);
    }
    const auto* from = reinterpret_cast<const char*>(some.data());
    for (size_t left = some.size() * sizeof(IndexEntry); left > 0;) {
      const ssize_t wrote = pwrite(fd_, from, left, static_cast<off_t>(end_));
      if (wrote < 0 && errno == EINTR) continue;
      if (wrote <= 0) Fail("write");
      from += wrote;
      left -= static_cast<size_t>(wrote);
      end_ += static_cast<uint64_t>(wrote);
    }
  }
}

void EntrySorter::Merge(size_t buffer_bytes, const std::function<void(const PlacedEntry&)>& take) {
  std::vector<Source> sources;
  if (runs_.empty()) {
    if (held_ == 0) return;
    for (const std::span<PlacedEntry> sorted : SortHeld()) {
      if (!sorted.empty()) sources.emplace_back(sorted);
    }
  } else {
    Spill();
    entries_.reset();
    const size_t entries = std::max<size_t>(1, buffer_bytes / runs_.size() / sizeof(PlacedEntry));
    sources.reserve(runs_.size());
    for (const Run& run : runs_) sources.emplace_back(*this, run, entries);
  }
  // The least on top.
  const auto is_later = [&](size_t a, size_t b) { return sources[b].First() < sources[a].First(); };
  std::vector<size_t> heap(sources.size());
  for (size_t s = 0; s < heap.size(); ++s) heap[s] = s;
  std::make_heap(heap.begin(), heap.end(), is_later);
  while (!heap.empty()) {
    std::pop_heap(heap.begin(), heap.end(), is_later);
    Source& least = sources[heap.back()];
    take(least.First());
    least.Pop();
    if (least.IsEmpty()) {
      heap.pop_back();
    } else {
      std::push_heap(heap.begin(), heap.end(), is_later);
    }
  }
}

void EntrySorter::OpenFile() {
  if (fd_ >= 0) return;
  const fs::path folder = fs::absolute(index_).parent_path();
#ifdef O_TMPFILE
  fd_ = open(folder.c_str(), O_TMPFILE | O_RDWR | O_EXCL | O_CLOEXEC, 0600);
  if (fd_ >= 0) return;
#endif
  // If the file system has no such files, one has a name for a moment.
  std::string name = (folder / ".retint-index-XXXXXX").string();
  fd_ = mkostemp(name.data(), O_CLOEXEC);
  if (fd_ < 0) Fail("make");
  unlink(name.c_str());
}

void EntrySorter::Fail(const char* what) const {
  throw RunError(index_.string() + ": cannot " + what +
                 " its temporary file: " + std::strerror(errno));
}

}  // namespace retint
