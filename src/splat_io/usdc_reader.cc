// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usdc_reader.h"

#include <array>
#include <stdexcept>
#include <unordered_map>

#include "base/error.h"
#include "base/files.h"
#include "splat_io/compression.h"
#include "splat_io/splat_row.h"
#include "splat_io/usdc_compression.h"

namespace retint {
namespace {

constexpr int kOldest = 7, kNewest = 13;   // minor versions
constexpr uint64_t kLeastCompressed = 16;  // shorter arrays are never compressed
constexpr size_t kMostSections = 64, kMostFieldsOfSpec = 1024;

// A reference to a stored value.
struct Rep {
  uint64_t bits = 0;
  CrateType type() const { return static_cast<CrateType>(bits >> 48 & 0xff); }
  bool array() const { return bits & kCrateArray; }
  bool inlined() const { return bits & kCrateInlined; }
  bool compressed() const { return bits & kCrateCompressed; }
  uint64_t payload() const { return bits & ((uint64_t{1} << 48) - 1); }
};

struct PathNode {
  int64_t parent = -1;  // into the table of paths; -1 for the root and unused ones
  std::string_view name;
  bool property = false, used = false;
};

struct Spec {
  uint64_t path = 0, fields = 0;  // into the tables
  CrateSpec type{};
};

class CrateReader {
 public:
  CrateReader(std::string_view bytes, const std::filesystem::path& path)
      : bytes_(bytes), path_(path) {}

  UsdStage Read() && {
    try {
      ReadSections();
      ReadTokens();
      ReadStrings();
      ReadFields();
      ReadPaths();
      ReadSpecs();
    } catch (const std::runtime_error& error) {
      if (dynamic_cast<const InputError*>(&error)) throw;
      Fail(error.what());
    }
    CountUses();
    AddPrims();
    AddAttributes();
    return std::move(stage_);
  }

 private:
  [[noreturn]] void Fail(const std::string& fault) const {
    throw InputError(path_, "the crate: " + fault);
  }

  template <typename T>
  T At(uint64_t offset) const {
    return LoadAs<T>(Bytes(offset, sizeof(T)).data());
  }

  std::string_view Bytes(uint64_t offset, uint64_t size) const {
    if (offset > bytes_.size() || size > bytes_.size() - offset) {
      Fail("truncated: " + std::to_string(size) + " bytes at offset " + std::to_string(offset) +
           " are missing");
    }
    return bytes_.substr(offset, size);
  }

  // Counts the memory of unpacked values, because many attributes may share one array.
  void Charge(uint64_t memory) const {
    charged_ += memory;
    if (charged_ > MostUnpacked(bytes_.size())) Fail("its values are more than it can hold");
  }

  // Reads the count of a table whose elements take `memory` bytes each when unpacked.
  uint64_t Count(ByteReader& reader, uint64_t memory) const {
    const auto count = reader.Read<uint64_t>("a count");
    if (count > MostUnpacked(bytes_.size()) / memory) {
      Fail("announces " + std::to_string(count) + " entries, more than it can hold");
    }
    return count;
  }

  std::vector<int32_t> Integers(ByteReader& reader, uint64_t count) const {
    const auto size = reader.Read<uint64_t>("a size");
    return UnpackCrateIntegers(reader.ReadBytes(size, "integers"), count);
  }

  void ReadSections() {
    const int major = At<uint8_t>(8), minor = At<uint8_t>(9);
    if (major != 0 || minor < kOldest || minor > kNewest) {
      Fail("version " + std::to_string(major) + "." + std::to_string(minor) +
           " is not supported; supported: 0.7 to 0.13");
    }
    const auto table = At<uint64_t>(16);
    const auto count = At<uint64_t>(table);
    if (count > kMostSections) Fail("the table of sections is damaged");
    for (uint64_t i = 0; i < count; ++i) {
      const uint64_t at = table + 8 + 32 * i;
      std::string name(Bytes(at, 16));
      name.resize(std::min(name.find('\0'), name.size()));
      sections_[name] = Bytes(At<uint64_t>(at + 16), At<uint64_t>(at + 24));
    }
  }

  ByteReader Section(const char* name) const {
    const auto found = sections_.find(name);
    if (found == sections_.end()) Fail("lacks its section " + std::string(name));
    return {found->second, path_};
  }

  void ReadTokens() {
    ByteReader reader = Section("TOKENS");
    const uint64_t count = Count(reader, sizeof(std::string_view));
    const auto size = reader.Read<uint64_t>("a size"), packed = reader.Read<uint64_t>("a size");
    if (size > MostUnpacked(bytes_.size())) Fail("announces more tokens than it can hold");
    token_bytes_ = UnpackCrateBytes(reader.ReadBytes(packed, "tokens"), size);
    std::string_view rest = token_bytes_;
    for (uint64_t i = 0; i < count; ++i) {
      const size_t end = rest.find('\0');
      if (end == std::string_view::npos) Fail("its tokens are damaged");
      tokens_.push_back(rest.substr(0, end));
      rest.remove_prefix(end + 1);
    }
  }

  void ReadStrings() {
    ByteReader reader = Section("STRINGS");
    const uint64_t count = Count(reader, 4);
    reader.Require(count, 4, "strings");
    for (uint64_t i = 0; i < count; ++i) strings_.push_back(reader.Read<uint32_t>("a string"));
  }

  void ReadFields() {
    ByteReader reader = Section("FIELDS");
    const uint64_t count = Count(reader, sizeof(Rep) + 4);
    field_names_ = Integers(reader, count);
    const auto size = reader.Read<uint64_t>("a size");
    const std::string reps = UnpackCrateBytes(reader.ReadBytes(size, "values"), 8 * count);
    if (reps.size() != 8 * count) Fail("its fields are damaged");
    reps_.resize(count);
    std::memcpy(reps_.data(), reps.data(), reps.size());
    ByteReader sets = Section("FIELDSETS");
    field_sets_ = Integers(sets, Count(sets, 8));
  }

  void ReadPaths() {
    ByteReader reader = Section("PATHS");
    paths_.resize(Count(reader, sizeof(PathNode)));
    const uint64_t count = Count(reader, sizeof(PathNode));
    const std::vector<int32_t> indices = Integers(reader, count), names = Integers(reader, count),
                               jumps = Integers(reader, count);
    // The next node and the path above it. Siblings wait until the subtree before them is done.
    struct Step {
      uint64_t at;
      int64_t parent;
      size_t depth;
    };
    std::vector<Step> waiting;
    if (count > 0) waiting.push_back({0, -1, 0});
    while (!waiting.empty()) {
      Step step = waiting.back();
      waiting.pop_back();
      for (bool more = true; more; ++step.at) {
        if (step.at >= count || step.depth > kMostUsdDepth + 1) Fail("its paths are damaged");
        const auto index = static_cast<uint32_t>(indices[step.at]);
        if (index >= paths_.size() || paths_[index].used) Fail("its paths are no tree");
        const int64_t name = names[step.at];
        const int64_t jump = jumps[step.at];
        paths_[index] = {step.parent, Token(static_cast<uint64_t>(std::abs(name))), name < 0, true};
        order_.push_back(index);
        const bool child = jump > 0 || jump == -1, sibling = jump >= 0;
        if (child && sibling) {
          waiting.push_back({step.at + static_cast<uint64_t>(jump), step.parent, step.depth});
        }
        if (child || step.parent < 0) {
          step.parent = index;
          ++step.depth;
        }
        more = child || sibling;
      }
    }
  }

  void ReadSpecs() {
    ByteReader reader = Section("SPECS");
    const uint64_t count = Count(reader, sizeof(Spec) + 12);
    const std::vector<int32_t> paths = Integers(reader, count), fields = Integers(reader, count),
                               types = Integers(reader, count);
    for (uint64_t i = 0; i < count; ++i) {
      const Spec spec = {static_cast<uint32_t>(paths[i]), static_cast<uint32_t>(fields[i]),
                         static_cast<CrateSpec>(types[i])};
      if (spec.path >= paths_.size() || !paths_[spec.path].used) Fail("a spec has no path");
      spec_of_path_[spec.path] = spec;
    }
  }

  std::string_view Token(uint64_t index) const {
    if (index >= tokens_.size()) Fail("lacks token " + std::to_string(index));
    return tokens_[index];
  }

  // Calls each(name, rep) for the fields of a spec.
  template <typename Each>
  void ForFields(const Spec& spec, const Each& each) const {
    for (uint64_t i = 0;; ++i) {
      if (spec.fields + i >= field_sets_.size() || i == kMostFieldsOfSpec) {
        Fail("a set of fields has no end");
      }
      const auto field = static_cast<uint32_t>(field_sets_[spec.fields + i]);
      if (field == kCrateEnd) return;
      if (field >= reps_.size()) Fail("lacks field " + std::to_string(field));
      each(Token(static_cast<uint32_t>(field_names_[field])), reps_[field]);
    }
  }

  // If several attributes share an array, it cannot be changed for only one of them.
  void CountUses() {
    uint64_t fields = 0;
    for (const auto& [path, spec] : spec_of_path_) {
      ForFields(spec, [&](std::string_view, Rep rep) {
        if (++fields > MostUnpacked(bytes_.size()) / 8) Fail("its specs have too many fields");
        if (rep.array() && !rep.inlined()) ++uses_[rep.payload()];
      });
    }
  }

  void AddPrims() {
    prim_of_path_.assign(paths_.size(), -1);
    for (const uint32_t index : order_) {
      const auto found = spec_of_path_.find(index);
      if (found == spec_of_path_.end()) continue;
      const Spec& spec = found->second;
      if (spec.type == CrateSpec::kRoot) AddStage(spec);
      if (spec.type != CrateSpec::kPrim) continue;
      const int64_t above = paths_[index].parent;
      const bool top = above >= 0 && paths_[static_cast<size_t>(above)].parent < 0;
      const int64_t parent = above < 0 ? -1 : prim_of_path_[static_cast<size_t>(above)];
      if (!top && parent < 0) {
        stage_.variants = true;
        continue;
      }
      if (stage_.prims.size() == kMostUsdPrims) Fail("holds more prims than is supported");
      Charge(sizeof(UsdPrim));
      prim_of_path_[index] = static_cast<int64_t>(stage_.prims.size());
      UsdPrim& prim = stage_.prims.emplace_back();
      prim.parent = parent;
      prim.name = paths_[index].name;
      AddPrim(spec, prim);
    }
  }

  void AddStage(const Spec& spec) {
    ForFields(spec, [&](std::string_view name, Rep rep) {
      if (name == "upAxis") {
        stage_.z_up = Text(rep) == "Z";
      } else if (name == "metersPerUnit") {
        const std::vector<double> numbers = Numbers(rep);
        if (numbers.size() == 1) stage_.meters_per_unit = numbers[0];
      } else if (name == "subLayers") {
        stage_.refers = true;
      }
    });
  }

  void AddPrim(const Spec& spec, UsdPrim& prim) {
    ForFields(spec, [&](std::string_view name, Rep rep) {
      if (name == "specifier") {
        prim.defined = rep.payload() == 0;
      } else if (name == "typeName") {
        prim.type = Text(rep);
      } else if (name == "active") {
        prim.active = rep.payload() != 0;
      } else if (name == "variantSetNames") {
        stage_.variants = true;
      }
      for (const char* arc : {"references", "payload", "inheritPaths", "specializes"}) {
        if (name == arc) stage_.refers = true;
      }
    });
  }

  void AddAttributes() {
    for (const uint32_t index : order_) {
      const PathNode& node = paths_[index];
      const auto found = spec_of_path_.find(index);
      const int64_t above = node.parent;
      const int64_t owner = above < 0 ? -1 : prim_of_path_[static_cast<size_t>(above)];
      if (found == spec_of_path_.end() || found->second.type != CrateSpec::kAttribute ||
          owner < 0) {
        continue;
      }
      UsdPrim& prim = stage_.prims[static_cast<size_t>(owner)];
      if (!IsUsdAttribute(prim.type, node.name) || prim.attributes.size() >= kMostUsdAttributes) {
        continue;
      }
      Charge(sizeof(UsdValue));
      UsdValue& value = prim.attributes[std::string(node.name)];
      ForFields(found->second, [&](std::string_view name, Rep rep) {
        if (name == "default") {
          SetValue(value, UsdArrayComponents(node.name), rep);
        } else if (name == "timeSamples" || name == "spline") {
          value.animated = true;
        } else if (name == "colorSpace") {
          value.color_space = Text(rep);
        }
      });
    }
  }

  void SetValue(UsdValue& value, size_t components, Rep rep) const {
    if (rep.array() && components > 0) {
      SetArray(value, components, rep);
    } else if (rep.array() && rep.type() == CrateType::kToken) {
      SetTokens(value, rep);
    } else if (!rep.array()) {
      value.text = Text(rep);
      value.numbers = Numbers(rep);
    }
  }

  std::string Text(Rep rep) const {
    if (rep.array() || !rep.inlined()) return {};
    uint64_t index = rep.payload();
    if (rep.type() == CrateType::kString) {
      if (index >= strings_.size()) Fail("lacks a string");
      index = strings_[index];
    } else if (rep.type() != CrateType::kToken) {
      return {};
    }
    const std::string_view text = Token(index);
    Charge(text.size());
    return std::string(text);
  }

  void SetTokens(UsdValue& value, Rep rep) const {
    if (rep.payload() == 0) return;
    const auto count = At<uint64_t>(rep.payload());
    if (count > kMostUsdAttributes) Fail("a list of tokens is too long");
    Charge(count * sizeof(std::string));
    for (uint64_t i = 0; i < count; ++i) {
      Charge(Token(At<uint32_t>(rep.payload() + 8 + 4 * i)).size());
      value.tokens.emplace_back(Token(At<uint32_t>(rep.payload() + 8 + 4 * i)));
    }
  }

  // Bytes per component, and number of components; 0 for other types.
  static std::pair<size_t, size_t> Layout(CrateType type) {
    switch (type) {
      case CrateType::kHalf:
        return {2, 1};
      case CrateType::kFloat:
        return {4, 1};
      case CrateType::kDouble:
        return {8, 1};
      case CrateType::kMatrix4d:
        return {8, 16};
      case CrateType::kQuatd:
        return {8, 4};
      case CrateType::kQuatf:
        return {4, 4};
      case CrateType::kQuath:
        return {2, 4};
      case CrateType::kVec3d:
        return {8, 3};
      case CrateType::kVec3f:
        return {4, 3};
      case CrateType::kVec3h:
        return {2, 3};
      default:
        return {0, 0};
    }
  }

  static double Load(const char* from, size_t bytes) {
    return bytes == 2   ? HalfToFloat(LoadAs<uint16_t>(from))
           : bytes == 4 ? LoadAs<float>(from)
                        : LoadAs<double>(from);
  }

  static bool IsQuat(CrateType type) {
    return type == CrateType::kQuatd || type == CrateType::kQuatf || type == CrateType::kQuath;
  }

  std::vector<double> Numbers(Rep rep) const {
    const uint64_t payload = rep.payload();
    const auto low = static_cast<uint32_t>(payload);
    if (rep.type() == CrateType::kInt || rep.type() == CrateType::kBool) {
      return {double(static_cast<int32_t>(low))};
    }
    const auto [bytes, count] = Layout(rep.type());
    if (bytes == 0) return {};
    if (!rep.inlined()) {
      std::vector<double> numbers;
      const std::string_view stored = Bytes(payload, bytes * count);
      for (size_t i = 0; i < count; ++i) numbers.push_back(Load(&stored[i * bytes], bytes));
      // The real part is stored last.
      if (IsQuat(rep.type())) std::rotate(numbers.begin(), numbers.end() - 1, numbers.end());
      return numbers;
    }
    if (rep.type() == CrateType::kHalf) return {HalfToFloat(static_cast<uint16_t>(low))};
    if (count == 1) return {LoadAs<float>(reinterpret_cast<const char*>(&low))};
    // Small whole numbers are stored as bytes, a matrix by its diagonal.
    std::vector<double> numbers(count);
    for (size_t i = 0; i < (count == 16 ? 4 : count); ++i) {
      numbers[count == 16 ? 5 * i : i] = static_cast<int8_t>(payload >> 8 * i & 0xff);
    }
    return numbers;
  }

  void SetArray(UsdValue& value, size_t components, Rep rep) const {
    const auto [bytes, count] = Layout(rep.type());
    if (count != components || bytes == 0 || bytes == 8) {
      Fail("an array of the Gaussians has an unexpected type");
    }
    value.components = components;
    if (rep.inlined() || rep.payload() == 0) return;  // empty
    const uint64_t at = rep.payload();
    const auto elements = At<uint64_t>(at);
    if (rep.compressed() && elements >= kLeastCompressed) {
      return SetCompressed(value, at + 8, elements, bytes);
    }
    if (elements > bytes_.size() / (bytes * components)) {
      Fail("announces " + std::to_string(elements) + " values, more than it can hold");
    }
    const std::string_view stored = Bytes(at + 8, elements * bytes * components);
    Charge(elements * components * sizeof(float));
    value.floats.resize(elements * components);
    value.begin = at + 8;
    value.end = value.begin + stored.size();
    const auto uses = uses_.find(at);
    if (uses == uses_.end() || uses->second == 1) {
      value.storage = bytes == 2 ? UsdStorage::kHalves : UsdStorage::kFloats;
    }
    if (bytes == 4) std::memcpy(value.floats.data(), stored.data(), stored.size());
    for (size_t i = 0; bytes == 2 && i < value.floats.size(); ++i) {
      value.floats[i] = HalfToFloat(LoadAs<uint16_t>(&stored[2 * i]));
    }
    for (size_t i = 0; components == 4 && i < value.floats.size(); i += 4) {
      float* quat = &value.floats[i];
      std::rotate(quat, quat + 3, quat + 4);
    }
  }

  // Whole numbers are compressed directly; other values as indices into a table of distinct values.
  void SetCompressed(UsdValue& value, uint64_t at, uint64_t elements, size_t bytes) const {
    if (elements > bytes_.size()) {
      Fail("announces " + std::to_string(elements) + " values, more than it can hold");
    }
    Charge(2 * elements * sizeof(float));
    const char code = At<char>(at);
    std::string_view table;
    if (code == 't') {
      const uint64_t size = At<uint32_t>(at + 1);
      table = Bytes(at + 5, size * bytes);
      at += 4 + table.size();
    } else if (code != 'i') {
      Fail("an array is compressed in an unknown way");
    }
    std::vector<int32_t> integers;
    try {
      integers = UnpackCrateIntegers(Bytes(at + 9, At<uint64_t>(at + 1)), elements);
    } catch (const InputError&) {
      throw;
    } catch (const std::runtime_error& error) {
      Fail(error.what());
    }
    for (const int32_t integer : integers) {
      const uint64_t index = static_cast<uint32_t>(integer);
      if (code == 't' && index >= table.size() / bytes) Fail("an array's table is damaged");
      value.floats.push_back(code == 't' ? static_cast<float>(Load(&table[index * bytes], bytes))
                                         : static_cast<float>(integer));
    }
  }

  std::string_view bytes_;
  const std::filesystem::path& path_;
  std::map<std::string, std::string_view> sections_;
  std::string token_bytes_;
  std::vector<std::string_view> tokens_;
  std::vector<uint32_t> strings_, order_;  // paths in order from the root
  std::vector<int32_t> field_names_, field_sets_;
  std::vector<Rep> reps_;
  std::vector<PathNode> paths_;
  std::unordered_map<uint64_t, Spec> spec_of_path_;
  std::unordered_map<uint64_t, uint32_t> uses_;  // by the offset of an array
  std::vector<int64_t> prim_of_path_;
  mutable uint64_t charged_ = 0;  // bytes of memory
  UsdStage stage_;
};

}  // namespace

UsdStage ReadUsdc(std::string_view bytes, const std::filesystem::path& path) {
  return CrateReader(bytes, path).Read();
}

}  // namespace retint
