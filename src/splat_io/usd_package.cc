// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usd_package.h"

#include <zlib.h>

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/printable.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

constexpr uint32_t kLocal = 0x04034b50, kCentral = 0x02014b50, kEnd = 0x06054b50;
constexpr size_t kLocalBytes = 30, kCentralBytes = 46, kEndBytes = 22, kMostComment = 65535;
constexpr size_t kAlignment = 64;
constexpr uint16_t kVersion = 20, kDate = 0x21;  // 1980-01-01: bytes do not depend on the date
constexpr size_t kMostFiles = 65535;

bool IsLayerName(std::string_view name) {
  return name.ends_with(".usda") || name.ends_with(".usdc") || name.ends_with(".usd");
}

uint32_t Checksum(std::string_view bytes, uint32_t before = 0) {
  for (size_t at = 0; at < bytes.size();) {
    const size_t size = std::min<size_t>(bytes.size() - at, size_t{1} << 30);
    before = static_cast<uint32_t>(
        crc32(before, reinterpret_cast<const Bytef*>(bytes.data() + at), static_cast<uInt>(size)));
    at += size;
  }
  return before;
}

template <typename... Values>
std::string Packed(Values... values) {
  std::string bytes;
  (bytes.append(reinterpret_cast<const char*>(&values), sizeof values), ...);
  return bytes;
}

uint32_t Short(uint64_t value) { return static_cast<uint32_t>(value); }

}  // namespace

bool IsUsdPackage(std::string_view head) {
  if (head.size() < kLocalBytes || LoadAs<uint32_t>(head.data()) != kLocal) return false;
  return IsLayerName(head.substr(kLocalBytes, LoadAs<uint16_t>(head.data() + 26)));
}

std::vector<UsdPackageFile> ReadUsdPackage(std::string_view archive,
                                           const std::filesystem::path& path) {
  const auto fail = [&](const std::string& fault) { throw InputError(path, fault); };
  size_t end = std::string_view::npos;
  for (size_t back = kEndBytes; back <= std::min(archive.size(), kEndBytes + kMostComment);
       ++back) {
    if (LoadAs<uint32_t>(archive.data() + archive.size() - back) == kEnd) {
      end = archive.size() - back;
      break;
    }
  }
  if (end == std::string_view::npos) fail("truncated, or the package's zip archive is damaged");
  const size_t count = LoadAs<uint16_t>(archive.data() + end + 10);
  uint64_t at = LoadAs<uint32_t>(archive.data() + end + 16);
  std::vector<UsdPackageFile> files;
  for (size_t i = 0; i < count; ++i) {
    if (at > end || end - at < kCentralBytes || LoadAs<uint32_t>(archive.data() + at) != kCentral) {
      fail("the package's list of files is damaged");
    }
    const char* entry = archive.data() + at;
    const uint64_t name_bytes = LoadAs<uint16_t>(entry + 28);
    const uint64_t further = uint64_t{LoadAs<uint16_t>(entry + 30)} + LoadAs<uint16_t>(entry + 32);
    if (end - at - kCentralBytes < name_bytes + further) {
      fail("the package's list of files is damaged");
    }
    UsdPackageFile file;
    file.name = std::string(entry + kCentralBytes, name_bytes);
    const std::string shown = Printable(file.name.substr(0, 80));
    if (LoadAs<uint16_t>(entry + 10) != 0 || LoadAs<uint16_t>(entry + 8) & 1) {
      fail("its file " + shown + " is compressed or encrypted, which a .usdz must not be");
    }
    const uint64_t bytes = LoadAs<uint32_t>(entry + 24), local = LoadAs<uint32_t>(entry + 42);
    if (local > archive.size() || archive.size() - local < kLocalBytes ||
        LoadAs<uint32_t>(archive.data() + local) != kLocal) {
      fail("its file " + shown + " is missing from the package");
    }
    const uint64_t begin = local + kLocalBytes + LoadAs<uint16_t>(archive.data() + local + 26) +
                           LoadAs<uint16_t>(archive.data() + local + 28);
    if (begin > archive.size() || archive.size() - begin < bytes) {
      fail("truncated: its file " + shown + " of " + std::to_string(bytes) + " bytes is not whole");
    }
    file.bytes = archive.substr(begin, bytes);
    if (Checksum(file.bytes) != LoadAs<uint32_t>(entry + 16)) {
      fail("its file " + shown + " is damaged");
    }
    files.push_back(std::move(file));
    at += kCentralBytes + name_bytes + further;
  }
  if (files.empty()) fail("the package has no files");
  return files;
}

void UsdPackageWriter::CheckSize(uint64_t at) const {
  if (at > std::numeric_limits<uint32_t>::max() || entries_.size() > kMostFiles) {
    throw RunError(path_.string() + ": not written: a .usdz holds 4 GiB at most; write a .usdc");
  }
}

std::string UsdPackageWriter::LocalHeader(const Entry& entry) {
  std::string header =
      Packed(kLocal, kVersion, uint16_t{0}, uint16_t{0}, uint16_t{0}, kDate, entry.checksum,
             Short(entry.bytes), Short(entry.bytes), static_cast<uint16_t>(entry.name.size()),
             static_cast<uint16_t>(entry.padding));
  header += entry.name;
  // Padding is an extra field of an unused kind, with a header of 4 bytes.
  header += Packed(uint16_t{0x1986}, static_cast<uint16_t>(entry.padding - 4));
  return header += std::string(entry.padding - 4, '\0');
}

void UsdPackageWriter::Add(const std::string& name,
                           const std::function<void(const Write&)>& content) {
  Entry entry;
  entry.name = name;
  entry.at = at_;
  entry.padding = kAlignment - (at_ + kLocalBytes + name.size()) % kAlignment;
  if (entry.padding < 4) entry.padding += kAlignment;
  file_.Write(LocalHeader(entry));
  content([&](std::string_view bytes) {
    entry.bytes += bytes.size();
    entry.checksum = Checksum(bytes, entry.checksum);
    file_.Write(bytes);
  });
  const std::string header = LocalHeader(entry);
  at_ += header.size() + entry.bytes;
  entries_.push_back(entry);
  CheckSize(at_);
  file_.WriteAt(entry.at, header.data(), header.size());
}

void UsdPackageWriter::Finish() {
  const uint64_t begin = at_;
  for (const Entry& entry : entries_) {
    const std::string record =
        Packed(kCentral, kVersion, kVersion, uint16_t{0}, uint16_t{0}, uint16_t{0}, kDate,
               entry.checksum, Short(entry.bytes), Short(entry.bytes),
               static_cast<uint16_t>(entry.name.size()), uint16_t{0}, uint16_t{0}, uint16_t{0},
               uint16_t{0}, uint32_t{0}, Short(entry.at)) +
        entry.name;
    file_.Write(record);
    at_ += record.size();
  }
  CheckSize(at_);
  const auto count = static_cast<uint16_t>(entries_.size());
  file_.Write(Packed(kEnd, uint16_t{0}, uint16_t{0}, count, count, Short(at_ - begin), Short(begin),
                     uint16_t{0}));
}

}  // namespace retint
