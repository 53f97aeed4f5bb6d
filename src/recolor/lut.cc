// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/lut.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include <OpenColorIO/OpenColorIO.h>

#include "base/error.h"
#include "base/files.h"
#include "base/printable.h"
#include "base/temporary_folder.h"

namespace retint {
namespace {

namespace ocio = OCIO_NAMESPACE;

constexpr int kSampledSize = 65;
constexpr size_t kMostBytes = size_t{64} << 20;  // of a file; 129^3 colors in text take 60 MB
constexpr long kMost1dSize = 1 << 16;

std::string LowerExtension(const std::filesystem::path& path) {
  std::string text = path.extension().string();
  for (char& c : text) c = char(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// The announced sizes of a .cube file, before anybody takes memory for them. OpenColorIO tries a
// file that is no .cube as every other format that it knows, and leaks in some: values that come
// before a size are refused here.
void CheckCubeSizes(const std::filesystem::path& path, const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  bool has_size = false;
  std::array<float, 3> least = {0, 0, 0}, greatest = {1, 1, 1};  // of the domain
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::string key, value;
    words >> key >> value;
    const bool is_word = !key.empty() && std::isalpha(static_cast<unsigned char>(key[0])) != 0;
    if (!has_size && !key.empty() && key[0] != '#' && !is_word) {
      throw InputError(path, "has values before LUT_1D_SIZE or LUT_3D_SIZE");
    }
    if (key == "DOMAIN_MIN" || key == "DOMAIN_MAX") {
      std::istringstream numbers(line.substr(line.find(key) + key.size()));
      for (float& number : key == "DOMAIN_MIN" ? least : greatest) numbers >> number;
    }
    if (key != "LUT_3D_SIZE" && key != "LUT_1D_SIZE") continue;
    has_size = true;
    const long most = key == "LUT_3D_SIZE" ? kMaxColorTableSize : kMost1dSize;
    char* end = nullptr;
    const long size = std::strtol(value.c_str(), &end, 10);
    if (value.empty() || *end != 0 || size < 2 || size > most) {
      throw InputError(path,
                       key + " " + value + " is not a size from 2 to " + std::to_string(most));
    }
  }
  if (!has_size) throw InputError(path, "has neither LUT_1D_SIZE nor LUT_3D_SIZE");
  for (size_t c = 0; c < 3; ++c) {
    if (!(least[c] < greatest[c])) {
      throw InputError(path, "has a DOMAIN_MIN that is not below its DOMAIN_MAX");
    }
  }
}

// OpenColorIO's reason for rejecting the file `name`. Several formats share an extension; this is
// the first one's message, without the names of format and file.
std::string ReasonOf(const std::string& message, const std::string& name) {
  constexpr std::string_view kFailed = "' failed with: ";
  std::string reason = OneLine(message);
  if (const auto first = reason.find(kFailed); first != std::string::npos) {
    reason.erase(0, first + kFailed.size());
    const auto second = reason.find(kFailed);
    if (second != std::string::npos) reason.erase(reason.rfind(" '", second - 1));
  }
  for (const std::string& before : {"(" + name + "). ", "'" + name + "' ",
                                    std::string("Error is: "), std::string(".3dl file.")}) {
    const auto at = reason.find(before);
    if (at != std::string::npos) reason.erase(0, at + before.size());
  }
  return OneLine(reason);
}

// The values that the file itself holds: sampling could step over one that is not finite.
template <typename Table>
void CheckTable(const Table& table, size_t count, const std::filesystem::path& path) {
  for (size_t i = 0; i < count; ++i) {
    float r = 0, g = 0, b = 0;
    if constexpr (std::is_same_v<Table, ocio::Lut1DTransform>) {
      table.getValue(static_cast<unsigned long>(i), r, g, b);
    } else {
      const auto n = size_t(table.getGridSize());
      table.getValue(static_cast<unsigned long>(i / (n * n)), static_cast<unsigned long>(i / n % n),
                     static_cast<unsigned long>(i % n), r, g, b);
    }
    if (!std::isfinite(r) || !std::isfinite(g) || !std::isfinite(b)) {
      throw InputError(path, "entry " + std::to_string(i) + " of its table is not finite");
    }
  }
}

// Nodes a side that represent the transform: its own where it is a 3D table and nothing else.
int CheckOperations(const ocio::GroupTransform& group, const std::filesystem::path& path) {
  int own = 0;
  for (int i = 0; i < group.getNumTransforms(); ++i) {
    const ocio::ConstTransformRcPtr transform = group.getTransform(i);
    if (const auto cube = std::dynamic_pointer_cast<const ocio::Lut3DTransform>(transform)) {
      const auto n = size_t(cube->getGridSize());
      CheckTable(*cube, n * n * n, path);
      own = int(n);
    } else if (const auto curve =
                   std::dynamic_pointer_cast<const ocio::Lut1DTransform>(transform)) {
      CheckTable(*curve, curve->getLength(), path);
    }
  }
  const bool alone = group.getNumTransforms() == 1 && own >= 2 && own <= kMaxColorTableSize;
  return alone ? own : kSampledSize;
}

ocio::ConstTransformRcPtr FileTransform(const std::string& name) {
  const ocio::FileTransformRcPtr file = ocio::FileTransform::Create();
  file->setSrc(name.c_str());
  file->setInterpolation(ocio::INTERP_TETRAHEDRAL);
  return file;
}

// Of a file of corrections the first. A FileTransform would want it by its id, which a correction
// need not have.
ocio::ConstTransformRcPtr FirstCorrection(const std::string& name) {
  const ocio::GroupTransformRcPtr all = ocio::CDLTransform::CreateGroupFromFile(name.c_str());
  if (all->getNumTransforms() == 0) throw ocio::Exception("it holds no correction");
  return all->getTransform(0);
}

ocio::ConstProcessorRcPtr OpenTransform(const std::filesystem::path& path,
                                        const std::string& extension) {
  static std::once_flag quiet;
  std::call_once(quiet, [] { ocio::SetLoggingLevel(ocio::LOGGING_LEVEL_NONE); });
  ocio::ClearAllCaches();  // a file of the same name may have changed
  const std::string name = std::filesystem::absolute(path).string();
  const bool corrections = extension == ".cdl" || extension == ".cc" || extension == ".ccc";
  return ocio::Config::CreateRaw()->getProcessor(corrections ? FirstCorrection(name)
                                                             : FileTransform(name));
}

constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

std::vector<float> IdentityGrid(int size) {
  std::vector<float> values;
  values.reserve(size_t(size) * size_t(size) * size_t(size) * 3);
  const float step = 1.0f / float(size - 1);
  for (int b = 0; b < size; ++b) {
    for (int g = 0; g < size; ++g) {
      for (int r = 0; r < size; ++r) {
        for (const int at : {r, g, b}) values.push_back(float(at) * step);
      }
    }
  }
  return values;
}

}  // namespace

bool ColorTable::operator==(const ColorTable& other) const {
  return size == other.size && values == other.values && name == other.name && tone == other.tone;
}

void ColorTable::Check() const {
  CheckOption(size >= 2 && size <= kMaxColorTableSize, "color table: " + std::to_string(size) +
                                                           " nodes a side are not 2 to " +
                                                           std::to_string(kMaxColorTableSize));
  const size_t n = size_t(size);
  CheckOption(values.size() == n * n * n * 3, "color table: " + std::to_string(values.size()) +
                                                  " values are not those of " +
                                                  std::to_string(size) + " nodes a side");
  CheckOption(std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); }),
              "color table: NaN or infinite value");
}

std::shared_ptr<const ColorTable> ReadLut(const std::filesystem::path& path) {
  constexpr std::array kKnown = {".cube", ".3dl", ".clf", ".cdl", ".cc", ".ccc"};
  const std::string extension = LowerExtension(path);
  if (!IsFile(path)) throw InputError(path, "is not a file");
  if (std::find(kKnown.begin(), kKnown.end(), extension) == kKnown.end()) {
    throw InputError(path, "is not a .cube, .3dl, .clf, .cdl, .cc or .ccc file");
  }
  if (std::filesystem::file_size(path) > kMostBytes) {
    throw InputError(path, "is larger than any lookup table (64 MiB)");
  }
  // OpenColorIO reads files, and takes a byte order mark for a word: it gets a copy without it.
  std::optional<TemporaryFolder> folder;
  std::filesystem::path read = path;
  if (extension == ".cube") {
    std::string text = ReadFile(path);
    if (text.starts_with(kByteOrderMark)) {
      text.erase(0, kByteOrderMark.size());
      folder.emplace();
      read = folder->path() / path.filename();
      WriteFile(read, text);
    }
    CheckCubeSizes(path, text);
  }
  auto table = std::make_shared<ColorTable>();
  try {
    const ocio::ConstProcessorRcPtr processor = OpenTransform(read, extension);
    table->size = CheckOperations(*processor->createGroupTransform(), path);
    table->values = IdentityGrid(table->size);
    ocio::PackedImageDesc grid(table->values.data(), table->size * table->size, table->size, 3);
    processor->getDefaultCPUProcessor()->apply(grid);
    if (!std::all_of(table->values.begin(), table->values.end(),
                     [](float value) { return std::isfinite(value); })) {
      throw InputError(path, "turns colors into values that are not finite");
    }
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(path, "is not a lookup table that can be read: " +
                               ReasonOf(error.what(), std::filesystem::absolute(read).string()));
  }
  table->name = path.filename().string();
  table->file = std::filesystem::absolute(path).lexically_normal();
  return table;
}

}  // namespace retint
