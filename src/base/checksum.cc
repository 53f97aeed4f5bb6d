// SPDX-License-Identifier: BSD-3-Clause
#include "base/checksum.h"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "base/error.h"
#include "base/files.h"

namespace retint {
namespace {

constexpr uint64_t kPrime1 = 0x9E3779B185EBCA87ULL, kPrime2 = 0xC2B2AE3D27D4EB4FULL,
                   kPrime3 = 0x165667B19E3779F9ULL, kPrime4 = 0x85EBCA77C2B2AE63ULL,
                   kPrime5 = 0x27D4EB2F165667C5ULL;

template <typename T>
T Load(const char* from) {
  static_assert(std::endian::native == std::endian::little);
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

uint64_t Round(uint64_t lane, uint64_t input) {
  return std::rotl(lane + input * kPrime2, 31) * kPrime1;
}

uint64_t Merge(uint64_t hash, uint64_t lane) { return (hash ^ Round(0, lane)) * kPrime1 + kPrime4; }

}  // namespace

Xxh64Stream::Xxh64Stream() : lanes_{kPrime1 + kPrime2, kPrime2, 0, 0 - kPrime1}, rest_{} {}

void Xxh64Stream::Add(std::string_view bytes) {
  total_ += bytes.size();
  const auto take = [this](const char* block) {
    for (size_t i = 0; i < 4; ++i) lanes_[i] = Round(lanes_[i], Load<uint64_t>(block + 8 * i));
  };
  if (rest_size_ > 0) {
    const size_t part = std::min(bytes.size(), sizeof(rest_) - rest_size_);
    std::memcpy(rest_ + rest_size_, bytes.data(), part);
    rest_size_ += part;
    bytes.remove_prefix(part);
    if (rest_size_ < sizeof(rest_)) return;
    take(rest_);
    rest_size_ = 0;
  }
  while (bytes.size() >= sizeof(rest_)) {
    take(bytes.data());
    bytes.remove_prefix(sizeof(rest_));
  }
  if (bytes.empty()) return;
  std::memcpy(rest_, bytes.data(), bytes.size());
  rest_size_ = bytes.size();
}

uint64_t Xxh64Stream::Get() const {
  uint64_t hash = kPrime5;
  if (total_ >= sizeof(rest_)) {
    hash = std::rotl(lanes_[0], 1) + std::rotl(lanes_[1], 7) + std::rotl(lanes_[2], 12) +
           std::rotl(lanes_[3], 18);
    for (const uint64_t lane : lanes_) hash = Merge(hash, lane);
  }
  hash += total_;
  const char* at = rest_;
  size_t left = rest_size_;
  for (; left >= 8; at += 8, left -= 8) {
    hash = std::rotl(hash ^ Round(0, Load<uint64_t>(at)), 27) * kPrime1 + kPrime4;
  }
  if (left >= 4) {
    hash = std::rotl(hash ^ (Load<uint32_t>(at) * kPrime1), 23) * kPrime2 + kPrime3;
    at += 4;
    left -= 4;
  }
  for (; left > 0; ++at, --left) {
    hash = std::rotl(hash ^ (Load<uint8_t>(at) * kPrime5), 11) * kPrime1;
  }
  hash = (hash ^ (hash >> 33)) * kPrime2;
  hash = (hash ^ (hash >> 29)) * kPrime3;
  return hash ^ (hash >> 32);
}

uint64_t Xxh64(std::string_view bytes) {
  Xxh64Stream stream;
  stream.Add(bytes);
  return stream.Get();
}

FileChecksum ChecksumFile(const std::filesystem::path& path) {
  if (!IsFile(path)) throw InputError(path, "no such file");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             &std::fclose);
  if (!file) throw InputError(path, std::strerror(errno));
  std::vector<char> buffer(size_t{1} << 20);
  Xxh64Stream stream;
  FileChecksum sum;
  size_t got = 0;
  while ((got = std::fread(buffer.data(), 1, buffer.size(), file.get())) > 0) {
    stream.Add({buffer.data(), got});
    sum.bytes += got;
  }
  if (std::ferror(file.get())) throw InputError(path, "cannot be read");
  sum.xxh64 = stream.Get();
  return sum;
}

std::string HexText(uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(value));
  return text;
}

}  // namespace retint
