// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/gltf_file.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "base/base64.h"
#include "base/error.h"
#include "base/files.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

using Json = nlohmann::json;

constexpr uint32_t kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

struct ComponentType {
  uint64_t id;
  uint64_t bytes;
  double most;  // for a normalized integer
};
constexpr std::array<ComponentType, 6> kComponentTypes = {{{5120, 1, 127},
                                                           {5121, 1, 255},
                                                           {5122, 2, 32767},
                                                           {5123, 2, 65535},
                                                           {5125, 4, 4294967295.0},
                                                           {kGltfFloat, 4, 1}}};

double LoadComponent(uint64_t id, const char* from) {
  switch (id) {
    case 5120:
      return LoadAs<int8_t>(from);
    case 5121:
      return LoadAs<uint8_t>(from);
    case 5122:
      return LoadAs<int16_t>(from);
    case 5123:
      return LoadAs<uint16_t>(from);
    case 5125:
      return LoadAs<uint32_t>(from);
    default:
      return LoadAs<float>(from);
  }
}

std::string FromPercent(std::string_view uri) {
  std::string name;
  for (size_t i = 0; i < uri.size(); ++i) {
    const auto hex = [](char c) {
      return std::string_view("0123456789abcdef").find(static_cast<char>(std::tolower(c)));
    };
    const bool escape =
        uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) < 16 && hex(uri[i + 2]) < 16;
    name += escape ? static_cast<char>(hex(uri[i + 1]) * 16 + hex(uri[i + 2])) : uri[i];
    i += escape ? 2 : 0;
  }
  return name;
}

}  // namespace

void GltfFile::Fail(const std::string& fault) const { throw InputError(path_, fault); }

const char* GltfBuffer::Bytes(uint64_t offset, size_t bytes, std::vector<char>& room) const {
  if (!file_) return bytes_.data() + offset;
  if (room.size() < bytes) room.resize(bytes);
  file_->ReadAt(at_ + offset, room.data(), bytes);
  return room.data();
}

GltfFile::GltfFile(const std::filesystem::path& path) : path_(path), files_{path} {
  const auto file = std::make_shared<const InputFile>(path);
  std::string magic(std::min<uint64_t>(4, file->size()), '\0');
  file->ReadAt(0, magic.data(), magic.size());
  if (magic == "glTF") {
    ReadGlb(file);
  } else {
    json_ = ParseJson(ReadFile(path), path_, "the glTF");
    LoadBuffers(std::nullopt);
  }
}

void GltfFile::ReadGlb(const std::shared_ptr<const InputFile>& file) {
  uint64_t at = 0, end = file->size();
  const auto read = [&](uint64_t bytes, const std::string& what) {
    if (bytes > end - at) {
      Fail("truncated: its " + what + " needs " + std::to_string(bytes) + " bytes, only " +
           std::to_string(end - at) + " bytes follow offset " + std::to_string(at));
    }
    std::string data(bytes, '\0');
    file->ReadAt(at, data.data(), bytes);
    at += bytes;
    return data;
  };
  const std::string header = read(12, "header");
  const auto version = LoadAs<uint32_t>(header.data() + 4);
  if (version != 2) {
    Fail("glTF version " + std::to_string(version) + " is not supported; supported: 2");
  }
  const auto length = LoadAs<uint32_t>(header.data() + 8);
  if (length > file->size() || length < at) {
    Fail("truncated or damaged: announces " + std::to_string(length) + " bytes, has " +
         std::to_string(file->size()));
  }
  end = length;
  ignored_bytes_ = file->size() - length;
  std::optional<GltfBuffer> binary;
  for (bool first = true; at < end; first = false) {
    const std::string chunk = read(8, "chunk's header");
    const uint64_t bytes = LoadAs<uint32_t>(chunk.data());
    const auto type = LoadAs<uint32_t>(chunk.data() + 4);
    if (first != (type == kJsonChunk)) Fail("its chunks are in a wrong order");
    if (first) {
      json_ = ParseJson(read(bytes, "JSON"), path_, "its JSON");
      continue;
    }
    if (bytes > end - at) {
      Fail("truncated: a chunk of " + std::to_string(bytes) + " bytes is not whole");
    }
    if (type == kBinaryChunk && !binary) binary.emplace(file, at, bytes);
    at += bytes;
  }
  LoadBuffers(std::move(binary));
}

void GltfFile::LoadBuffers(std::optional<GltfBuffer> binary) {
  const auto found = json_.find("buffers");
  const size_t count = found != json_.end() && found->is_array() ? found->size() : 0;
  for (size_t i = 0; i < count; ++i) {
    const Json& buffer = Item("buffers", i);
    const auto uri = buffer.find("uri");
    if (uri != buffer.end() && !uri->is_string()) Fail("a buffer's uri is no text");
    if (uri != buffer.end()) {
      buffers_.push_back(LoadUri(uri->get<std::string>()));
    } else if (i == 0 && binary) {
      buffers_.push_back(*std::move(binary));
    } else {
      buffers_.emplace_back(std::string());
    }
    const uint64_t length = Whole(buffer, "byteLength", 0);
    if (buffers_.back().size() < length) {
      Fail("truncated: buffer " + std::to_string(i) + " announces " + std::to_string(length) +
           " bytes, has " + std::to_string(buffers_.back().size()));
    }
  }
}

GltfBuffer GltfFile::LoadUri(const std::string& uri) {
  if (uri.starts_with("data:")) {
    const size_t comma = uri.find(";base64,");
    std::string bytes;
    if (comma == std::string::npos ||
        !DecodeBase64(std::string_view(uri).substr(comma + 8), bytes)) {
      Fail("a buffer's data is not base64");
    }
    return GltfBuffer(std::move(bytes));
  }
  const std::filesystem::path name = FromPercent(uri);
  const bool outside = name.is_absolute() || name.empty() || uri.find(':') != std::string::npos ||
                       std::find(name.begin(), name.end(), "..") != name.end();
  if (outside) Fail("a buffer is named outside of its folder");
  files_.push_back(path_.parent_path() / name);
  const auto file = std::make_shared<const InputFile>(files_.back());
  return GltfBuffer(file, 0, file->size());
}

uint64_t GltfFile::BufferBytes() const {
  uint64_t bytes = 0;
  for (const GltfBuffer& buffer : buffers_) bytes += buffer.size();
  return bytes;
}

const Json& GltfFile::Item(const char* list, uint64_t index) const {
  const auto found = json_.find(list);
  if (found == json_.end() || !found->is_array() || index >= found->size() ||
      !(*found)[index].is_object()) {
    Fail("lacks number " + std::to_string(index) + " of its " + list);
  }
  return (*found)[index];
}

uint64_t GltfFile::Whole(const Json& object, const char* name, uint64_t otherwise) const {
  const auto found = object.find(name);
  if (found == object.end()) return otherwise;
  if (!found->is_number_unsigned()) Fail(std::string(name) + " is not a whole number");
  return found->get<uint64_t>();
}

uint64_t GltfFile::Count(uint64_t accessor) const {
  return Whole(Item("accessors", accessor), "count", 0);
}

void GltfValues::LoadElement(const char* from, float* to) const {
  for (uint64_t c = 0; c < components; ++c) {
    double value = LoadComponent(type, from + c * bytes);
    if (most > 0) value = std::max(value / most, -1.0);
    to[c] = static_cast<float>(value);
  }
}

GltfValues GltfFile::View(uint64_t accessor, int components) const {
  const std::string name = "accessor " + std::to_string(accessor);
  const Json& object = Item("accessors", accessor);
  if (object.contains("sparse")) Fail(name + " is sparse, which is not supported");
  if (!object.contains("bufferView")) Fail(name + " has no data: is it compressed?");
  const std::string type =
      components == 1 ? std::string("SCALAR") : "VEC" + std::to_string(components);
  if (!IsText(Member(object, "type"), type)) Fail(name + " is not of type " + type);
  const uint64_t id = Whole(object, "componentType", 0);
  const auto component =
      std::find_if(kComponentTypes.begin(), kComponentTypes.end(),
                   [&](const ComponentType& candidate) { return candidate.id == id; });
  if (component == kComponentTypes.end()) Fail(name + " has an unknown component type");
  const Json* flag = Member(object, "normalized");
  const bool normalized = flag && flag->is_boolean() && flag->get<bool>();

  const Json& view = Item("bufferViews", Whole(object, "bufferView", 0));
  const uint64_t index = Whole(view, "buffer", 0);
  if (index >= buffers_.size()) Fail(name + " is in a buffer that is missing");
  const GltfBuffer& buffer = buffers_[index];
  const uint64_t view_at = Whole(view, "byteOffset", 0), view_bytes = Whole(view, "byteLength", 0);
  const uint64_t at = Whole(object, "byteOffset", 0), count = Count(accessor);
  const uint64_t element = component->bytes * static_cast<uint64_t>(components);
  const uint64_t stride = Whole(view, "byteStride", element);
  // Compared by subtraction and division, because sums and products could overflow.
  if (view_at > buffer.size() || view_bytes > buffer.size() - view_at || stride < element ||
      count == 0 || at > view_bytes || element > view_bytes - at ||
      count - 1 > (view_bytes - at - element) / stride) {
    Fail(name + " of " + std::to_string(count) + " elements does not fit into its buffer");
  }
  return {&buffer,
          view_at + at,
          count,
          static_cast<uint64_t>(components),
          stride,
          id,
          component->bytes,
          normalized ? component->most : 0};
}

}  // namespace retint
