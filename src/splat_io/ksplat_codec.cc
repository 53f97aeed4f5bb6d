// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/ksplat_codec.h"

#include <array>

#include "base/files.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

constexpr size_t kHeaderBytes = 4096, kSectionHeaderBytes = 1024;
constexpr size_t kBlockRows = 16384;

struct Header {
  uint32_t max_sections = 0, count = 0;
  int level = 0;  // compression level
  float sh_least = 0, sh_most = 0;
};

struct Section {
  uint32_t count = 0, capacity = 0;  // Gaussians in use, and Gaussians with room
  uint32_t bucket_capacity = 0, buckets = 0, full_buckets = 0, partial_buckets = 0;
  float block_size = 0;
  uint32_t range = 0;  // of a quantized position
  int sh_degree = 0;
  uint64_t bucket_bytes = 0;
  uint64_t sizes_at = 0, buckets_at = 0, records_at = 0, end = 0;  // offsets in the file
};

// Offsets of a record's parts, and bytes of its SH.
struct Record {
  size_t scale_at, rotation_at, color_at, sh_at, sh_bytes;
  size_t Bytes(int sh_degree) const {
    const auto side = static_cast<size_t>(sh_degree + 1);
    return sh_at + 3 * (side * side - 1) * sh_bytes;
  }
};
constexpr std::array<Record, 3> kRecords = {
    {{12, 24, 40, 44, 4}, {6, 12, 20, 24, 2}, {6, 12, 20, 24, 1}}};

class KsplatFile {
 public:
  KsplatFile(const std::string& bytes, const std::filesystem::path& path)
      : bytes_(bytes), path_(path) {
    ReadHeader();
    ReadSections();
  }

  GaussianModel Read(Monitor& monitor) const {
    int degree = 0;
    for (const Section& section : sections_) {
      if (section.count > 0) degree = std::max(degree, section.sh_degree);
    }
    GaussianModel model;
    model.Resize(header_.count, degree);
    size_t first = 0;
    for (const Section& section : sections_) {
      const std::vector<uint32_t> bucket_ends = BucketEnds(section);
      size_t bucket = 0;
      for (size_t i = 0; i < section.count; ++i) {
        if ((first + i) % kBlockRows == 0) {
          monitor.Step("load", static_cast<double>(first + i), header_.count);
        }
        while (bucket < bucket_ends.size() && i >= bucket_ends[bucket]) ++bucket;
        SetRow(model, first + i, Decode(section, i, bucket));
      }
      first += section.count;
    }
    return model;
  }

 private:
  [[noreturn]] void Fail(const std::string& fault) const { throw InputError(path_, fault); }

  template <typename T>
  T At(uint64_t offset) const {
    return LoadAs<T>(bytes_.data() + offset);
  }

  void ReadHeader() {
    if (bytes_.size() < kHeaderBytes) Fail("truncated: the header has 4096 bytes");
    const auto major = At<uint8_t>(0), minor = At<uint8_t>(1);
    if (major != 0 || minor < 1) {
      Fail("version " + std::to_string(major) + "." + std::to_string(minor) +
           " of .ksplat is not supported; supported: 0.1");
    }
    header_.max_sections = At<uint32_t>(4);
    header_.count = At<uint32_t>(16);
    header_.level = At<uint16_t>(20);
    if (header_.level > 2) {
      Fail("compression level " + std::to_string(header_.level) + ", expected 0 to 2");
    }
    if (header_.count == 0) Fail("holds no Gaussians");
    // 0 means the default.
    header_.sh_least = At<float>(36) != 0 ? At<float>(36) : -1.5f;
    header_.sh_most = At<float>(40) != 0 ? At<float>(40) : 1.5f;
  }

  void ReadSections() {
    if (header_.max_sections > (bytes_.size() - kHeaderBytes) / kSectionHeaderBytes) {
      Fail("truncated: the header announces " + std::to_string(header_.max_sections) + " sections");
    }
    uint64_t at = kHeaderBytes + uint64_t{header_.max_sections} * kSectionHeaderBytes;
    uint64_t count = 0;
    for (uint32_t s = 0; s < header_.max_sections; ++s) {
      sections_.push_back(ReadSection(kHeaderBytes + s * kSectionHeaderBytes, at, s));
      at = sections_.back().end;
      count += sections_.back().count;
    }
    if (count != header_.count) {
      Fail("the sections hold " + std::to_string(count) + " Gaussians, the header announces " +
           std::to_string(header_.count));
    }
  }

  Section ReadSection(uint64_t from, uint64_t at, uint32_t index) const {
    const std::string name = "section " + std::to_string(index);
    Section section;
    section.count = At<uint32_t>(from);
    section.capacity = At<uint32_t>(from + 4);
    section.bucket_capacity = At<uint32_t>(from + 8);
    section.buckets = At<uint32_t>(from + 12);
    section.block_size = At<float>(from + 16);
    section.bucket_bytes = At<uint16_t>(from + 20);
    section.range = At<uint32_t>(from + 24);
    if (section.range == 0) section.range = header_.level == 0 ? 1 : 32767;
    section.full_buckets = At<uint32_t>(from + 32);
    section.partial_buckets = At<uint32_t>(from + 36);
    section.sh_degree = At<uint16_t>(from + 40);
    if (section.sh_degree > 3) {
      Fail(name + ": SH degree " + std::to_string(section.sh_degree) + ", expected 0 to 3");
    }
    if (section.count > section.capacity) Fail(name + " holds more Gaussians than it has room for");
    // Each factor has at most 32 bits, so no product overflows 64.
    section.sizes_at = at;
    section.buckets_at = at + uint64_t{4} * section.partial_buckets;
    section.records_at = section.buckets_at + section.bucket_bytes * section.buckets;
    section.end = section.records_at +
                  uint64_t{kRecords[static_cast<size_t>(header_.level)].Bytes(section.sh_degree)} *
                      section.capacity;
    if (section.end > bytes_.size()) {
      Fail("truncated: " + name + " ends at byte " + std::to_string(section.end) +
           ", the file at " + std::to_string(bytes_.size()));
    }
    if (header_.level > 0 && section.count > 0) CheckBuckets(section, name);
    return section;
  }

  void CheckBuckets(const Section& section, const std::string& name) const {
    if (section.bucket_bytes < 12 ||
        uint64_t{section.full_buckets} + section.partial_buckets > section.buckets) {
      Fail(name + " has fewer buckets than it uses");
    }
    uint64_t room = uint64_t{section.full_buckets} * section.bucket_capacity;
    for (uint32_t b = 0; b < section.partial_buckets; ++b) {
      room += At<uint32_t>(section.sizes_at + uint64_t{4} * b);
    }
    if (room < section.count) Fail(name + " has Gaussians that are in no bucket");
  }

  // For each bucket in use: the index after its last Gaussian.
  std::vector<uint32_t> BucketEnds(const Section& section) const {
    std::vector<uint32_t> ends;
    if (header_.level == 0 || section.count == 0) return ends;
    uint64_t end = 0;
    for (uint32_t b = 0; b < section.full_buckets && end < section.count; ++b) {
      if (section.bucket_capacity == 0) break;
      end += section.bucket_capacity;
      ends.push_back(static_cast<uint32_t>(std::min<uint64_t>(end, section.count)));
    }
    ends.resize(section.full_buckets, ends.empty() ? 0 : ends.back());
    for (uint32_t b = 0; b < section.partial_buckets; ++b) {
      end += At<uint32_t>(section.sizes_at + uint64_t{4} * b);
      ends.push_back(static_cast<uint32_t>(std::min<uint64_t>(end, section.count)));
    }
    return ends;
  }

  // A float, or a binary16 above level 0.
  float Number(uint64_t at, size_t index) const {
    return header_.level == 0 ? At<float>(at + 4 * index)
                              : HalfToFloat(At<uint16_t>(at + 2 * index));
  }

  float Sh(uint64_t at, size_t index) const {
    if (header_.level < 2) return Number(at, index);
    const float t = static_cast<float>(At<uint8_t>(at + index)) / 255;
    return header_.sh_least + t * (header_.sh_most - header_.sh_least);
  }

  SplatRow Decode(const Section& section, size_t g, size_t bucket) const {
    const Record& record = kRecords[static_cast<size_t>(header_.level)];
    const uint64_t at = section.records_at + g * record.Bytes(section.sh_degree);
    SplatRow row;
    for (size_t i = 0; i < 3; ++i) {
      if (header_.level == 0) {
        row.mean[i] = At<float>(at + 4 * i);
      } else {
        const double step = section.block_size / 2.0 / section.range;
        row.mean[i] = static_cast<float>(
            (static_cast<double>(At<uint16_t>(at + 2 * i)) - section.range) * step +
            At<float>(section.buckets_at + section.bucket_bytes * bucket + 4 * i));
      }
      row.log_scale[i] = LogScale(Number(at + record.scale_at, i));
      row.sh[i] = (static_cast<float>(At<uint8_t>(at + record.color_at + i)) / 255 - 0.5f) / kShC0;
    }
    row.opacity_logit = LogitOfByte(At<uint8_t>(at + record.color_at + 3));
    for (size_t i = 0; i < 4; ++i) row.quat_wxyz[i] = Number(at + record.rotation_at, i);
    // One band after the other; in each, the coefficients of red, then green, then blue.
    size_t from = 0;
    for (int l = 1; l <= section.sh_degree; ++l) {
      const auto width = static_cast<size_t>(2 * l + 1), k = static_cast<size_t>(l * l);
      for (size_t c = 0; c < 3; ++c) {
        for (size_t m = 0; m < width; ++m) {
          row.sh[3 * (k + m) + c] = Sh(at + record.sh_at, from++);
        }
      }
    }
    return row;
  }

  const std::string& bytes_;
  const std::filesystem::path& path_;
  Header header_;
  std::vector<Section> sections_;
};

}  // namespace

std::span<const std::string_view> KsplatCodec::Extensions() const {
  static constexpr std::array<std::string_view, 1> extensions = {".ksplat"};
  return extensions;
}

GaussianModel KsplatCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                                BadRows bad) const {
  monitor.Step("load", 0, 1);
  const std::string bytes = ReadFile(path);
  GaussianModel model = KsplatFile(bytes, path).Read(monitor);
  ValidateRead(model, path, bad);
  return model;
}

}  // namespace retint
