// SPDX-License-Identifier: BSD-3-Clause
// The parts of a glTF 2.0 file that hold numbers: JSON, buffers, accessors.
#pragma once

#include <cstdint>
#include <cstring>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "splat_io/json.h"

namespace retint {

inline constexpr uint64_t kGltfFloat = 5126;  // a component's type

// The numbers of an accessor where they lie in its buffer: [count, components].
struct GltfValues {
  const char* from = nullptr;
  uint64_t count = 0, components = 0;
  uint64_t stride = 0;           // bytes from one element to the next
  uint64_t type = 0, bytes = 0;  // of a component
  double most = 0;               // what a normalized integer is divided by; 0: it stands for itself

  // Element `index` into to[0 .. components).
  void Load(uint64_t index, float* to) const;
  // The same of kComponents of them.
  template <size_t kComponents>
  void LoadAll(uint64_t index, float* to) const {
    if (type != kGltfFloat) return Load(index, to);
    std::memcpy(to, from + index * stride, kComponents * sizeof(float));
  }
};

class GltfFile {
 public:
  // .glb or .gltf, by content. InputError when it is damaged, or a buffer is missing or shorter
  // than announced.
  explicit GltfFile(const std::filesystem::path& path);
  // Its buffers are views of what it holds.
  GltfFile(const GltfFile&) = delete;
  GltfFile& operator=(const GltfFile&) = delete;

  const nlohmann::json& json() const { return json_; }
  const std::filesystem::path& path() const { return path_; }
  uint64_t BufferBytes() const;  // of all buffers

  // The object json()[list][index]; InputError where there is none.
  const nlohmann::json& Item(const char* list, uint64_t index) const;
  // A member that is a whole number; `otherwise` where it is missing, InputError where it is
  // something else.
  uint64_t Whole(const nlohmann::json& object, const char* name, uint64_t otherwise) const;
  // Number of elements of an accessor.
  uint64_t Count(uint64_t accessor) const;
  // Its values, valid as long as the file. InputError where it has another number of components,
  // lies outside of its buffer, or is sparse.
  GltfValues View(uint64_t accessor, int components) const;
  // The same as floats, [count, components], normalized integers as what they stand for.
  std::vector<float> Values(uint64_t accessor, int components) const;

  [[noreturn]] void Fail(const std::string& fault) const;

 private:
  void ReadGlb(std::string file);
  // `binary_chunk` lies in files_.
  void LoadBuffers(std::string_view binary_chunk);
  std::string LoadUri(const std::string& uri) const;

  std::filesystem::path path_;
  nlohmann::json json_;
  std::deque<std::string> files_;  // that the buffers lie in; never moved
  std::vector<std::string_view> buffers_;
};

}  // namespace retint
