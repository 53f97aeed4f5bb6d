// SPDX-License-Identifier: BSD-3-Clause
// The parts of a glTF 2.0 file that contain numbers: JSON, buffers, accessors.
#pragma once

#include <cstdint>
#include <cstring>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/input_file.h"
#include "splat_io/json.h"

namespace retint {

inline constexpr uint64_t kGltfFloat = 5126;  // a component's type

// The bytes of a buffer: in memory, or in a file, from which they are read on demand.
class GltfBuffer {
 public:
  explicit GltfBuffer(std::string bytes) : bytes_(std::move(bytes)), size_(bytes_.size()) {}
  // `size` bytes of the file from `at` on; the file must have them.
  GltfBuffer(std::shared_ptr<const InputFile> file, uint64_t at, uint64_t size)
      : file_(std::move(file)), at_(at), size_(size) {}

  uint64_t size() const { return size_; }
  // `bytes` bytes from `offset` on, which must exist. Uses `room` unless they are in memory
  // already. InputError if the file was truncated since it was opened.
  const char* Bytes(uint64_t offset, size_t bytes, std::vector<char>& room) const;

 private:
  std::string bytes_;
  std::shared_ptr<const InputFile> file_;
  uint64_t at_ = 0, size_ = 0;
};

// The values of an accessor, in place in their buffer: [count, components].
struct GltfValues {
  const GltfBuffer* buffer = nullptr;
  uint64_t at = 0;  // of the first element
  uint64_t count = 0, components = 0;
  uint64_t stride = 0;           // bytes from one element to the next
  uint64_t type = 0, bytes = 0;  // of a component
  double most = 0;               // divisor of a normalized integer; 0: not normalized

  // Copies elements [begin, end) to to[0 .. kComponents), to[to_stride ..], ... `room` is a buffer.
  template <size_t kComponents>
  void Load(uint64_t begin, uint64_t end, float* to, size_t to_stride,
            std::vector<char>& room) const {
    if (begin == end) return;
    const char* from =
        buffer->Bytes(at + begin * stride, (end - begin - 1) * stride + components * bytes, room);
    for (uint64_t i = begin; i < end; ++i, from += stride, to += to_stride) {
      if (type == kGltfFloat) {
        std::memcpy(to, from, kComponents * sizeof(float));
      } else {
        LoadElement(from, to);
      }
    }
  }

 private:
  void LoadElement(const char* from, float* to) const;
};

class GltfFile {
 public:
  // .glb or .gltf, by content. InputError if it is damaged, or if a buffer is missing or too
  // short.
  explicit GltfFile(const std::filesystem::path& path);
  // GltfValues point to its buffers.
  GltfFile(const GltfFile&) = delete;
  GltfFile& operator=(const GltfFile&) = delete;

  const nlohmann::json& json() const { return json_; }
  const std::filesystem::path& path() const { return path_; }
  uint64_t BufferBytes() const;                              // of all buffers
  uint64_t ignored_bytes() const { return ignored_bytes_; }  // after the end of a .glb
  // The file itself and the files of its buffers.
  const std::vector<std::filesystem::path>& files() const { return files_; }

  // The object json()[list][index]; InputError if there is none.
  const nlohmann::json& Item(const char* list, uint64_t index) const;
  // A member that is a whole number. If it is missing, `otherwise`; InputError if it is something
  // else.
  uint64_t Whole(const nlohmann::json& object, const char* name, uint64_t otherwise) const;
  // Number of elements of an accessor.
  uint64_t Count(uint64_t accessor) const;
  // Its values, valid as long as this file. InputError if it is sparse, exceeds its buffer, or has
  // another number of components.
  GltfValues View(uint64_t accessor, int components) const;

  [[noreturn]] void Fail(const std::string& fault) const;

 private:
  void ReadGlb(const std::shared_ptr<const InputFile>& file);
  // `binary` is the chunk of a .glb.
  void LoadBuffers(std::optional<GltfBuffer> binary);
  GltfBuffer LoadUri(const std::string& uri);

  std::filesystem::path path_;
  std::vector<std::filesystem::path> files_;
  nlohmann::json json_;
  std::deque<GltfBuffer> buffers_;  // never moved
  uint64_t ignored_bytes_ = 0;
};

}  // namespace retint
