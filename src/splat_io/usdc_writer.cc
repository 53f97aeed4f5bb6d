// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usdc_writer.h"

#include <algorithm>
#include <bit>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "splat_io/axes.h"
#include "splat_io/usd_splats.h"
#include "splat_io/usda_writer.h"
#include "splat_io/usdc_compression.h"
#include "splat_io/usdc_reader.h"

namespace retint {
namespace {

constexpr size_t kBlockRows = 4096;
constexpr uint64_t kMinorVersion = 8;

template <typename T>
void Append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// Collects tokens, fields, paths and specs as they are used, and makes their sections.
class Tables {
 public:
  // Index 0 has no negative, and negative indices mark properties.
  Tables() { Token(";-)"); }

  uint32_t Token(const std::string& text) {
    const auto [found, is_new] = token_index_.try_emplace(text, tokens_.size());
    if (is_new) tokens_.push_back(text);
    return static_cast<uint32_t>(found->second);
  }

  static uint64_t Inlined(CrateType type, uint32_t payload) {
    return kCrateInlined | static_cast<uint64_t>(type) << 48 | payload;
  }
  uint64_t TokenRep(const std::string& text) { return Inlined(CrateType::kToken, Token(text)); }

  using Fields = std::vector<std::pair<std::string, uint64_t>>;
  // `jump` of the path: -1 if it has only children, 0 if it has only siblings, -2 if it has
  // neither.
  void AddSpec(CrateSpec type, const std::string& name, int32_t jump, const Fields& fields) {
    const auto path = static_cast<int32_t>(paths_.size());
    const auto token = static_cast<int32_t>(name.empty() ? 0 : Token(name));
    paths_.push_back(path);
    path_names_.push_back(type == CrateSpec::kAttribute ? -token : token);
    jumps_.push_back(jump);
    spec_types_.push_back(static_cast<int32_t>(type));
    spec_fields_.push_back(static_cast<int32_t>(field_sets_.size()));
    for (const auto& [field, rep] : fields) {
      field_sets_.push_back(static_cast<int32_t>(reps_.size()));
      field_names_.push_back(static_cast<int32_t>(Token(field)));
      reps_.push_back(rep);
    }
    field_sets_.push_back(static_cast<int32_t>(kCrateEnd));
  }

  // All sections and their table, to be written at `at` of the file. Sets `table` to the table's
  // place.
  std::string Bytes(uint64_t at, uint64_t& table) const {
    const std::pair<const char*, std::string> sections[] = {
        {"TOKENS", TokenSection()}, {"STRINGS", std::string(8, '\0')},
        {"FIELDS", FieldSection()}, {"FIELDSETS", Integers({&field_sets_})},
        {"PATHS", PathSection()},   {"SPECS", Integers({&paths_, &spec_fields_, &spec_types_})},
    };
    std::string bytes, names;
    Append(names, uint64_t{std::size(sections)});
    for (const auto& [name, section] : sections) {
      std::string padded = name;
      padded.resize(16);
      names += padded;
      Append(names, at + bytes.size());
      Append(names, uint64_t{section.size()});
      bytes += section;
    }
    table = at + bytes.size();
    return bytes += names;
  }

 private:
  static void AppendPacked(std::string& section, const std::string& packed) {
    Append(section, uint64_t{packed.size()});
    section += packed;
  }

  // Columns of equal length, after their length.
  static std::string Integers(std::initializer_list<const std::vector<int32_t>*> columns) {
    std::string section;
    Append(section, uint64_t{(*columns.begin())->size()});
    for (const auto* column : columns) AppendPacked(section, PackCrateIntegers(*column));
    return section;
  }

  std::string TokenSection() const {
    std::string text, section;
    for (const std::string& token : tokens_) text += token + '\0';
    Append(section, uint64_t{tokens_.size()});
    Append(section, uint64_t{text.size()});
    AppendPacked(section, PackCrateBytes(text));
    return section;
  }

  std::string FieldSection() const {
    std::string section = Integers({&field_names_});
    AppendPacked(section, PackCrateBytes({reinterpret_cast<const char*>(reps_.data()),
                                          reps_.size() * sizeof(uint64_t)}));
    return section;
  }

  std::string PathSection() const {
    std::string section;
    Append(section, uint64_t{paths_.size()});
    return section += Integers({&paths_, &path_names_, &jumps_});
  }

  std::map<std::string, size_t> token_index_;
  std::vector<std::string> tokens_;
  std::vector<int32_t> field_names_, field_sets_, paths_, path_names_, jumps_, spec_fields_,
      spec_types_;
  std::vector<uint64_t> reps_;
};

struct ArrayOfFile {
  std::optional<UsdArray> array;  // none: the extent
  const char *name, *type;
  CrateType crate_type;
  size_t floats;  // per Gaussian
  uint64_t elements;
  uint64_t at = 0;
  uint64_t bytes() const {
    return elements * (crate_type == CrateType::kFloat   ? 4
                       : crate_type == CrateType::kQuatf ? 16
                                                         : 12);
  }
};

std::vector<ArrayOfFile> Arrays(const GaussianModel& model) {
  const uint64_t count = model.NumGaussians(), k = static_cast<uint64_t>(model.NumShCoeffs());
  return {
      {std::nullopt, "extent", "float3[]", CrateType::kVec3f, 0, 2},
      {UsdArray::kOpacities, "opacities", "float[]", CrateType::kFloat, 1, count},
      {UsdArray::kQuats, "orientations", "quatf[]", CrateType::kQuatf, 4, count},
      {UsdArray::kMeans, "positions", "point3f[]", CrateType::kVec3f, 3, count},
      {UsdArray::kColors, "radiance:sphericalHarmonicsCoefficients", "float3[]", CrateType::kVec3f,
       3 * k, k * count},
      {UsdArray::kScales, "scales", "float3[]", CrateType::kVec3f, 3, count},
  };
}

void WriteArray(const GaussianModel& model, const ArrayOfFile& array,
                const std::function<void(size_t)>& report,
                const std::function<void(std::string_view)>& write) {
  std::string block;
  Append(block, array.elements);
  if (!array.array) {
    Append(block, UsdExtent(model));
    return write(block);
  }
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    if (g % kBlockRows == 0) {
      report(g);
      write(block);
      block.clear();
    }
    const SplatRow row = FlipAxes(GetRow(model, g), kRightUpBack);
    std::vector<float> values = UsdValues(*array.array, row, model.sh_degree);
    // The real part is stored last.
    if (*array.array == UsdArray::kQuats) {
      std::rotate(values.begin(), values.begin() + 1, values.end());
    }
    block.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float));
  }
  write(block);
}

// Adds the stage, its prim, and the attributes. Returns the bytes of the lists of names, which come
// first, at `values`.
std::string AddSpecs(const GaussianModel& model, const std::vector<ArrayOfFile>& arrays,
                     uint64_t values, Tables& tables) {
  std::string lists;
  const auto list = [&](const std::vector<std::string>& names) {
    const uint64_t at = values + lists.size();
    Append(lists, uint64_t{names.size()});
    for (const std::string& name : names) Append(lists, tables.Token(name));
    lists.resize((lists.size() + 7) / 8 * 8);
    return static_cast<uint64_t>(CrateType::kTokenVector) << 48 | at;
  };
  const std::pair<const char*, std::string> hints[] = {
      {"colorSpace:name", std::string(NameOf(model.traits.color_space))},
      {"projectionModeHint", "perspective"},
      {"sortingModeHint", "zDepth"}};
  // A list edit that only prepends.
  const auto prepended = [&](const std::string& name) {
    const uint64_t at = values + lists.size();
    lists += static_cast<char>(1 << 5);
    Append(lists, uint64_t{1});
    Append(lists, tables.Token(name));
    lists.resize((lists.size() + 7) / 8 * 8);
    return static_cast<uint64_t>(CrateType::kTokenListOp) << 48 | at;
  };
  constexpr const char* kDegree = "radiance:sphericalHarmonicsDegree";
  std::vector<std::string> properties;
  for (const ArrayOfFile& array : arrays) properties.push_back(array.name);
  properties.push_back(kDegree);
  for (const auto& [name, value] : hints) properties.push_back(name);
  tables.AddSpec(
      CrateSpec::kRoot, "", -1,
      {{"defaultPrim", tables.TokenRep(kUsdSplatName)},
       {"metersPerUnit", Tables::Inlined(CrateType::kDouble, std::bit_cast<uint32_t>(1.0F))},
       {"upAxis", tables.TokenRep("Y")},
       {"primChildren", list({kUsdSplatName})}});
  tables.AddSpec(CrateSpec::kPrim, kUsdSplatName, -1,
                 {{"specifier", Tables::Inlined(CrateType::kSpecifier, 0)},
                  {"typeName", tables.TokenRep(std::string(kUsdSplatType))},
                  {"apiSchemas", prepended("ColorSpaceAPI")},
                  {"properties", list(properties)}});
  const auto inlined_int = [](int value) {
    return Tables::Inlined(CrateType::kInt, static_cast<uint32_t>(value));
  };
  for (const ArrayOfFile& array : arrays) {
    Tables::Fields fields = {
        {"typeName", tables.TokenRep(array.type)},
        {"default", kCrateArray | static_cast<uint64_t>(array.crate_type) << 48 | array.at}};
    if (array.array == UsdArray::kColors) {
      fields.emplace_back("elementSize", inlined_int(model.NumShCoeffs()));
      fields.emplace_back("interpolation", tables.TokenRep("vertex"));
    }
    tables.AddSpec(CrateSpec::kAttribute, array.name, 0, fields);
  }
  const uint64_t uniform = Tables::Inlined(CrateType::kVariability, 1);
  tables.AddSpec(CrateSpec::kAttribute, kDegree, 0,
                 {{"typeName", tables.TokenRep("int")},
                  {"variability", uniform},
                  {"default", inlined_int(model.sh_degree)}});
  for (const auto& [name, value] : hints) {
    tables.AddSpec(CrateSpec::kAttribute, name, &value == &hints[2].second ? -2 : 0,
                   {{"typeName", tables.TokenRep("token")},
                    {"variability", uniform},
                    {"default", tables.TokenRep(value)}});
  }
  return lists;
}

}  // namespace

void WriteUsdc(const GaussianModel& model, Monitor& monitor,
               const std::function<void(std::string_view)>& write) {
  std::vector<ArrayOfFile> arrays = Arrays(model);
  uint64_t at = kCrateHeader;
  for (ArrayOfFile& array : arrays) {
    array.at = at;
    at += (8 + array.bytes() + 7) / 8 * 8;
  }
  Tables tables;
  const std::string lists = AddSpecs(model, arrays, at, tables);
  uint64_t table = 0;
  const std::string sections = tables.Bytes(at + lists.size(), table);
  std::string header(kCrateMark);
  Append(header, kMinorVersion << 8);  // 0.8.0
  Append(header, table);
  header.resize(kCrateHeader);
  write(header);
  for (size_t a = 0; a < arrays.size(); ++a) {
    const size_t count = model.NumGaussians();
    WriteArray(
        model, arrays[a],
        [&](size_t done) {
          monitor.Step("save", static_cast<double>(a * count + done),
                       static_cast<double>(arrays.size() * count));
        },
        write);
    write(std::string((8 - (8 + arrays[a].bytes()) % 8) % 8, '\0'));
  }
  write(lists);
  write(sections);
}

}  // namespace retint
