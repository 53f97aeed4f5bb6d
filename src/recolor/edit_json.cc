// SPDX-License-Identifier: BSD-3-Clause
// Edits as JSON (docs/formats.md).
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/base64.h"
#include "base/error.h"
#include "base/escaped_bytes.h"
#include "base/files.h"
#include "base/unique_keys.h"
#include "recolor/edit_text.h"
#include "recolor/operation_text.h"

namespace retint {
namespace {

using Json = nlohmann::ordered_json;
using Kind = ColorOperationKind;
using Form = ColorParameter::Form;

// Keys of curves and levels, whose table follows from their points.
constexpr std::pair<const char*, Tone::Kind> kTones[] = {{"curve", Tone::Kind::kCurve},
                                                         {"levels", Tone::Kind::kLevels}};

constexpr size_t kMostBytes = size_t{64} << 20;  // of an edit's file

std::string EncodeFloats(const std::vector<float>& values) {
  static_assert(std::endian::native == std::endian::little);
  return EncodeBase64(
      {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)});
}

// Empty where it is not base64 of whole floats.
std::vector<float> DecodeFloats(std::string_view text) {
  std::string bytes;
  if (!DecodeBase64(text, bytes) || bytes.size() % sizeof(float) != 0) return {};
  std::vector<float> values(bytes.size() / sizeof(float));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::string Quoted(const std::string& text) { return "\"" + text + "\""; }

float JsonNumber(const Json& value, const std::string& where) {
  const double number =
      value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (!(std::abs(number) <= double(std::numeric_limits<float>::max()))) {
    throw OptionError(where + " is not a finite number");
  }
  return float(number);
}

// #rrggbb, a name, or three numbers.
std::vector<float> JsonColor(const Json& json, const ColorOperationType& type,
                             const std::string& where) {
  std::vector<float> values;
  if (json.is_string()) {
    const std::string text = json.get<std::string>();
    const OperationText reader(type, text);
    reader.AddColor(text, values);
    return values;
  }
  if (!json.is_array() || json.size() != 3) {
    throw OptionError(where + " is not a list of 3 numbers");
  }
  for (const Json& value : json) values.push_back(JsonNumber(value, where));
  return values;
}

// [{"from": color, "to": color}, ...], either or both left out.
std::vector<float> JsonPairs(const Json& json, const ColorOperationType& type,
                             const std::string& where) {
  if (!json.is_array()) throw OptionError(where + " is not a list");
  std::vector<float> values;
  for (const Json& pair : json) {
    if (!pair.is_object()) throw OptionError(where + ": a color is not an object");
    values.insert(values.end(), kPairValues, kUnset);
    for (const auto& [key, value] : pair.items()) {
      if (key != "from" && key != "to")
        throw OptionError(where + ": a color has no " + Quoted(key));
      const std::vector<float> color = JsonColor(value, type, where + "." + key);
      std::copy(color.begin(), color.end(), values.end() - (key == "from" ? 6 : 3));
    }
  }
  return values;
}

std::vector<float> JsonValues(const Json& json, const ColorParameter& parameter,
                              const ColorOperationType& type, const std::string& where) {
  if (parameter.form == Form::kColor) return JsonColor(json, type, where);
  if (parameter.form == Form::kPairs) return JsonPairs(json, type, where);
  std::vector<float> values;
  if (parameter.form == Form::kStops) {
    if (!json.is_array()) throw OptionError(where + " is not a list");
    for (const Json& stop : json) {
      if (!stop.is_array() || stop.size() != 4) {
        throw OptionError(where + ": a stop is not [at, red, green, blue]");
      }
      for (const Json& value : stop) values.push_back(JsonNumber(value, where));
    }
    return values;
  }
  if (parameter.count == 1) return {JsonNumber(json, where)};
  if (!json.is_array() || json.size() != size_t(parameter.count)) {
    throw OptionError(where + " is not a list of " + std::to_string(parameter.count) + " numbers");
  }
  for (const Json& value : json) values.push_back(JsonNumber(value, where));
  return values;
}

// People write names as they are, also such as hold %20.
std::filesystem::path FileOf(const std::string& name, const std::filesystem::path& folder) {
  std::filesystem::path file = folder / name;
  return IsFile(file) ? file : folder / UnescapeBytes(name);
}

std::shared_ptr<const ColorTable> TableFromJson(const Json& json, const std::string& where,
                                                const std::filesystem::path& folder) {
  const auto file = json.find("file");
  if (file != json.end() && !file->is_string()) throw OptionError(where + ".file is not a text");
  const std::string name = file == json.end() ? "" : file->get<std::string>();
  if (!json.contains("table")) {
    if (name.empty()) throw OptionError(where + " has no \"file\"");
    return ReadLut(FileOf(name, folder));
  }
  const Json& size = json.contains("size") ? json["size"] : Json();
  auto table = std::make_shared<ColorTable>();
  table->name = UnescapeBytes(name);
  if (!json["table"].is_string() || !size.is_number_integer()) {
    throw OptionError(where + " has a \"table\" without its \"size\", or one that is no text");
  }
  if (size < 2 || size > kMaxColorTableSize) {
    throw OptionError(where + ".size is " + size.dump() + ", not from 2 to " +
                      std::to_string(kMaxColorTableSize));
  }
  table->size = size.get<int>();
  table->values = DecodeFloats(json["table"].get_ref<const std::string&>());
  table->Check();
  return table;
}

std::shared_ptr<const ColorTable> ToneFromJson(const Json& json, Tone::Kind kind,
                                               const std::string& where) {
  if (!json.is_array()) throw OptionError(where + " is not a list of points");
  Tone tone{kind, {}};
  for (const Json& point : json) {
    if (!point.is_array() || point.size() != 2 || !point[0].is_number() || !point[1].is_number()) {
      throw OptionError(where + ": a point is not [in, out]");
    }
    tone.points.push_back({point[0].get<double>(), point[1].get<double>()});
  }
  try {
    return tone.Table();
  } catch (const OptionError& error) {
    throw OptionError(where + ": " + error.what());
  }
}

// A lookup table's colors: of a curve, of levels, of its values or of a file.
std::shared_ptr<const ColorTable> LutFromJson(const Json& json, const std::string& where,
                                              const std::filesystem::path& folder) {
  for (const auto& [key, kind] : kTones) {
    if (!json.contains(key)) continue;
    if (json.contains("file") || json.contains("table") || json.contains("size") ||
        (kind == Tone::Kind::kCurve && json.contains("levels"))) {
      throw OptionError(where + "." + key + " stands for the whole table");
    }
    return ToneFromJson(json[key], kind, where + "." + key);
  }
  return TableFromJson(json, where, folder);
}

std::string JsonText(const Json& json, const char* key, const std::string& where) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) {
    throw OptionError(where + " has no " + Quoted(key));
  }
  return found->get<std::string>();
}

int JsonSize(const Json& json, const char* key, const std::string& where) {
  constexpr int64_t kMost = 1 << 15;  // pixels
  const auto found = json.find(key);
  const int64_t value =
      found != json.end() && found->is_number_integer() ? found->get<int64_t>() : int64_t{-1};
  if (value < 0 || value > kMost) {
    throw OptionError(where + "." + key + " is not a number of pixels");
  }
  return int(value);
}

PaintLayer LayerFromJson(const Json& json, const std::string& where) {
  if (!json.is_object()) throw OptionError(where + " is not an object");
  PaintLayer layer;
  layer.view = UnescapeBytes(JsonText(json, "view", where));
  layer.x = JsonSize(json, "x", where);
  layer.y = JsonSize(json, "y", where);
  const int width = JsonSize(json, "width", where), height = JsonSize(json, "height", where);
  std::string bytes;
  if (!DecodeBase64(JsonText(json, "rgba", where), bytes) || bytes.empty() ||
      bytes.size() != size_t(width) * size_t(height) * 4) {
    throw OptionError(where + ".rgba does not hold its pixels");
  }
  layer.color = Image8(width, height);
  layer.alpha = Mask(width, height);
  for (size_t p = 0; p < layer.alpha.data.size(); ++p) {
    for (size_t c = 0; c < 3; ++c) layer.color.data[3 * p + c] = uint8_t(bytes[4 * p + c]);
    layer.alpha.data[p] = uint8_t(bytes[4 * p + 3]);
  }
  return layer;
}

Json LayerToJson(const PaintLayer& layer) {
  std::string bytes;
  for (size_t p = 0; p < layer.alpha.data.size(); ++p) {
    for (size_t c = 0; c < 3; ++c) bytes += char(layer.color.data[3 * p + c]);
    bytes += char(layer.alpha.data[p]);
  }
  return {{"view", EscapeBytes(layer.view)},
          {"x", layer.x},
          {"y", layer.y},
          {"width", layer.color.width},
          {"height", layer.color.height},
          {"rgba", EncodeBase64(bytes)}};
}

// The pictures of an operation, to be compared with a scene, or the result of that.
void PictureFromJson(const Json& json, const std::string& where,
                     const std::filesystem::path& folder, ColorOperation& op) {
  auto picture = std::make_shared<PictureEdit>();
  // Reports hold the result without the map and the paint: the pictures are compared again.
  const bool compared = op.IsSet("explained") && json.contains("layers");
  if (!compared) std::fill(op.values.begin(), op.values.end(), kUnset);
  const auto list = [&](const char* key) {
    const Json entries = json.contains(key) ? json[key] : Json::array();
    if (!entries.is_array()) throw OptionError(where + "." + key + " is not a list");
    return entries;
  };
  for (const Json& entry : list("pictures")) {
    const std::string place = where + ".pictures";
    if (!entry.is_object()) throw OptionError(place + ": an entry is not an object");
    const std::string file = JsonText(entry, "file", place);
    EditedPicture one{UnescapeBytes(JsonText(entry, "view", place)),
                      compared ? UnescapeBytes(file) : FileOf(file, folder).string(),
                      {}};
    one.compared = compared;
    picture->pictures.push_back(std::move(one));
  }
  for (const Json& entry : list("layers")) {
    picture->layers.push_back(LayerFromJson(entry, where + ".layers"));
  }
  if (!compared && picture->pictures.empty()) {
    throw OptionError(where + " has no \"pictures\"");
  }
  op.picture = std::move(picture);
  if (compared && json.contains("table")) op.table = TableFromJson(json, where, folder);
}

// As a JSON file in any folder names it.
std::string Findable(const std::filesystem::path& file) {
  return file.empty() ? std::string() : std::filesystem::absolute(file).lexically_normal().string();
}

void PictureToJson(const ColorOperation& op, bool with_tables, Json& json) {
  for (const EditedPicture& picture : op.picture->pictures) {
    json["pictures"].push_back(
        {{"view", EscapeBytes(picture.view)},
         {"file", EscapeBytes(with_tables ? picture.file : Findable(picture.file))}});
  }
  if (!with_tables || op.NeedsMeasuring()) return;
  json["layers"] = Json::array();
  for (const PaintLayer& layer : op.picture->layers) json["layers"].push_back(LayerToJson(layer));
}

ColorOperation OperationFromJson(const Json& json, const std::string& where,
                                 const std::filesystem::path& folder,
                                 std::vector<std::string>* warnings) {
  if (!json.is_object()) throw OptionError(where + " is not an object");
  const auto name = json.find("op");
  if (name == json.end() || !name->is_string()) throw OptionError(where + " has no \"op\"");
  const ColorOperationType* type = FindOperationType(name->get<std::string>());
  if (!type) throw OptionError(where + ": there is no operation " + Quoted(*name));
  ColorOperation op = ColorOperation::Make(type->kind);
  const bool lut = type->kind == Kind::kLut, picture = type->kind == Kind::kPicture;
  for (const auto& [key, value] : json.items()) {
    const bool of_table = key == "file" || key == "size" || key == "table";
    if (key == "op" || ((lut || picture) && of_table)) continue;
    if (lut && (key == "curve" || key == "levels")) continue;
    if (picture && (key == "pictures" || key == "layers")) continue;
    const std::string place = where + "." + key;
    if (key == "strength") {
      op.strength = JsonNumber(value, place);
      continue;
    }
    if (key == kGrayKey && type->kind == Kind::kWhiteBalance) {
      if (json.contains("temperature") || json.contains("tint")) {
        throw OptionError(place + " stands for temperature and tint");
      }
      const std::vector<float> gray = JsonColor(value, *type, place);
      for (const float channel : gray) {
        if (!(channel >= 0 && channel <= 1)) throw OptionError(place + " is not from 0 to 1");
      }
      SetGray(gray, op, warnings);
      continue;
    }
    const ColorParameter* parameter = FindParameter(*type, key);
    if (!parameter) throw OptionError(where + ": " + type->name + " has no " + Quoted(key));
    Set(op, *parameter, JsonValues(value, *parameter, *type, place));
  }
  for (const ColorParameter& parameter : type->parameters) {
    if (parameter.required && !json.contains(parameter.name)) {
      throw OptionError(where + ": " + type->name + " needs " + Quoted(parameter.name));
    }
  }
  if (lut) op.table = LutFromJson(json, where, folder);
  if (picture) PictureFromJson(json, where, folder, op);
  try {
    op.Check();
  } catch (const OptionError& error) {
    throw OptionError(where + ": " + error.what());
  }
  return op;
}

Json PairsToJson(std::span<const float> values) {
  Json json = Json::array();
  for (size_t i = 0; i + kPairValues <= values.size(); i += kPairValues) {
    Json pair = Json::object();
    for (const size_t at : {i, i + 3}) {
      if (values[at] == kUnset) continue;
      pair[at == i ? "from" : "to"] = {values[at], values[at + 1], values[at + 2]};
    }
    json.push_back(std::move(pair));
  }
  return json;
}

Json OperationToJson(const ColorOperation& op, bool with_tables) {
  const ColorOperationType& type = TypeOf(op.kind);
  Json json = {{"op", type.name}};
  if (op.strength != 1) json["strength"] = op.strength;
  for (const ColorParameter& parameter : type.parameters) {
    const std::span<const float> values = op.Get(parameter.name);
    if (parameter.form == Form::kPairs) {
      json[parameter.name] = PairsToJson(values);
      continue;
    }
    if (parameter.initial == kUnset && !op.IsSet(parameter.name)) continue;
    Json& to = json[parameter.name];
    if (parameter.form == Form::kStops) {
      for (size_t i = 0; i + 3 < values.size(); i += 4) {
        to.push_back({values[i], values[i + 1], values[i + 2], values[i + 3]});
      }
    } else if (parameter.count == 1) {
      to = values[0];
    } else {
      for (const float value : values) to.push_back(value);
    }
  }
  if (op.picture) PictureToJson(op, with_tables, json);
  if (!op.table || (op.picture && !with_tables)) return json;
  if (const auto& tone = op.table->tone) {
    Json& points = json[tone->kind == Tone::Kind::kCurve ? "curve" : "levels"];
    for (const TonePoint& point : tone->points) points.push_back({point.in, point.out});
    return json;
  }
  const bool by_name = with_tables || op.table->file.empty();
  json["file"] = EscapeBytes(by_name ? op.table->name : Findable(op.table->file));
  if (with_tables) {
    json["size"] = op.table->size;
    json["table"] = EncodeFloats(op.table->values);
  }
  return json;
}

Json Parse(std::string_view text) {
  try {
    return ParseWithUniqueKeys<Json>(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw OptionError("is not JSON, or cut off, at byte " + std::to_string(error.byte));
  } catch (const nlohmann::json::exception&) {
    throw OptionError("holds a number that is out of range");
  }
}

ColorEdit EditOf(const Json& json, const std::filesystem::path& folder,
                 std::vector<std::string>* warnings) {
  if (!json.is_object() || !json.contains("operations") || !json["operations"].is_array()) {
    throw OptionError("is not an edit: it has no list of \"operations\"");
  }
  ColorEdit edit;
  for (const auto& [key, value] : json.items()) {
    if (key == "strength") {
      edit.strength = JsonNumber(value, key);
    } else if (key != "operations") {
      throw OptionError("an edit has no " + Quoted(key));
    }
  }
  for (const Json& entry : json["operations"]) {
    const std::string where = "operations[" + std::to_string(edit.operations.size()) + "]";
    edit.operations.push_back(OperationFromJson(entry, where, folder, warnings));
  }
  edit.Check();
  return edit;
}

// A report's edit, or the object if it is an edit itself.
Json EditIn(Json json) {
  if (!json.is_object() || json.contains("operations") || !json.contains("edit")) return json;
  if (json["edit"].is_object()) return json["edit"];
  throw OptionError(
      "is a report without an edit of its own: write the \"edit\" of one of its \"regions\" into "
      "a file");
}

}  // namespace

ColorEdit EditFromJson(std::string_view text, const std::filesystem::path& folder,
                       std::vector<std::string>* warnings) {
  return EditOf(Parse(text), folder, warnings);
}

std::string EditToJson(const ColorEdit& edit, bool with_tables) {
  Json json = {{"operations", Json::array()}};
  if (edit.strength != 1) json["strength"] = edit.strength;
  for (const ColorOperation& op : edit.operations) {
    json["operations"].push_back(OperationToJson(op, with_tables));
  }
  return json.dump();
}

ColorEdit ReadEdit(const std::filesystem::path& path, std::vector<std::string>* warnings) {
  if (!IsFile(path)) throw InputError(path, "is not a file");
  if (std::filesystem::file_size(path) > kMostBytes) {
    throw InputError(path, "is larger than any edit (64 MiB)");
  }
  try {
    return EditOf(EditIn(Parse(ReadFile(path))), path.parent_path(), warnings);
  } catch (const OptionError& error) {
    throw InputError(path, error.what());
  }
}

}  // namespace retint
