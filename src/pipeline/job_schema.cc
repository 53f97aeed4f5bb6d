// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <nlohmann/json.hpp>

#include "pipeline/job_file.h"

namespace retint {
namespace {

using Json = nlohmann::ordered_json;

Json Text(const char* description) { return {{"type", "string"}, {"description", description}}; }

// An object that has these keys and no others.
Json Object(Json properties, std::vector<std::string> required = {}) {
  Json object = {{"type", "object"}, {"properties", std::move(properties)}};
  if (!required.empty()) object["required"] = std::move(required);
  object["additionalProperties"] = false;
  return object;
}

void AddRange(const OptionRange& range, Json* json) {
  if (std::isfinite(range.min)) {
    (*json)[range.min_open ? "exclusiveMinimum" : "minimum"] = range.min;
  }
  if (std::isfinite(range.max)) {
    (*json)[range.max_open ? "exclusiveMaximum" : "maximum"] = range.max;
  }
  if (range.multiple_of > 1) (*json)["multipleOf"] = range.multiple_of;
}

Json OptionSchema(const Option& option) {
  Json json;
  if (std::holds_alternative<bool*>(option.member)) {
    json["type"] = "boolean";
  } else if (std::holds_alternative<double*>(option.member)) {
    json["type"] = "number";
    AddRange(option.range, &json);
  } else if (const auto* choice = std::get_if<OptionChoice>(&option.member)) {
    json["enum"] = choice->names;
  } else {
    json["type"] = "integer";
    if (std::holds_alternative<uint64_t*>(option.member)) json["minimum"] = 0;
    AddRange(option.range, &json);
  }
  json["description"] = option.help + (option.unit.empty() ? "" : ", " + option.unit);
  std::visit([&](const auto& value) { json["default"] = value; }, option.Get());
  return json;
}

Json OptionsSchema(const OptionList& list) {
  Json properties = Json::object();
  for (const Option& option : list) {
    if (option.applies.empty()) {
      properties[option.name] = OptionSchema(option);
      continue;
    }
    Json& group = properties[option.applies];
    if (group.is_null()) group = Object(Json::object());
    group["properties"][option.name] = OptionSchema(option);
  }
  return Object(std::move(properties));
}

Json EditSchema() {
  Json names = Json::array();
  for (const ColorOperationType& type : ColorOperationTypes()) names.push_back(type.name);
  const Json operation = {{"type", "object"},
                          {"properties", {{"op", {{"enum", names}}}}},
                          {"required", {"op"}},
                          {"description", "its parameters are in docs/edits.md"}};
  Json edit = Object({{"operations", {{"type", "array"}, {"items", operation}}},
                      {"strength", {{"type", "number"}, {"minimum", 0}, {"maximum", 1}}}},
                     {"operations"});
  return {{"description", "what is done to the colors: an edit, or the file of one"},
          {"oneOf", {edit, Text("the file of an edit, or a report that has one")}}};
}

Json RegionSchema() {
  EditOptions options;
  OptionList selection;
  options.select.Describe(selection);
  options.projector.Describe(selection);
  RefineOptions refining;
  Json refine = OptionsSchema(Described(refining));
  refine["description"] =
      "split large Gaussians that take paint of the edit, or where it has none those inside the "
      "masks, before the job's fits";
  const Json paint = Object({{"view", Text("name of the painted image")},
                             {"mask", Text("a picture of its size, black outside")}},
                            {"view", "mask"});
  const Json masks = {
      {"description", "a folder of <image name>.png, or files by image name"},
      {"oneOf",
       {Text("the folder"), {{"type", "object"}, {"additionalProperties", {{"type", "string"}}}}}}};
  Json match = Object(
      {{"map", {{"enum", {"auto", "exposure", "balance", "matrix", "table"}}, {"default", "auto"}}},
       {"like", Text("another splat in the same frame; else the photos")},
       {"gray", Text("VIEW:X,Y,WIDTH,HEIGHT of a gray card, or its four corners")},
       {"checker", Text("the same of a ColorChecker of 24 patches")}});
  match["description"] =
      "finds the edit that brings all colors to the photos' or another splat's; excludes paint, "
      "masks and edit";
  Json region = Object({{"name", Text("unique; its folder of masks")},
                        {"paint", {{"type", "array"}, {"minItems", 1}, {"items", paint}}},
                        {"masks", masks},
                        {"invert_masks", {{"type", "boolean"}, {"default", false}}},
                        {"match", match},
                        {"edit", EditSchema()},
                        {"strength", {{"type", "number"}, {"minimum", 0}, {"maximum", 1}}},
                        {"options", OptionsSchema(selection)},
                        {"refine", refine}},
                       {"name"});
  region["oneOf"] = {{{"required", {"paint", "edit"}}},
                     {{"required", {"masks", "edit"}}},
                     {{"required", {"match"}}}};
  return region;
}

}  // namespace

std::string JobSchema() {
  EditOptions options;
  const Json scene = Object(
      {{"workspace", Text("COLMAP or nerfstudio workspace; without one, views are placed around "
                          "the splat")},
       {"splat", Text("the splat")},
       {"images", Text("folder of the photos, where not WORKSPACE/images")},
       {"model",
        Text("which sparse model of the workspace, such as 1 or dense/0; else the largest")},
       {"world_from_splat",
        Text("where the splat lies in the workspace's world: a .json file, or the 12 or 16 numbers "
             "of a matrix, by rows; else in the same frame")},
       {"render_model",
        {{"enum", {"default", "mip"}},
         {"description", "how the splat was trained; else the files say it"}}},
       {"space", Text("color space of the splat's colors, by its name in an OpenColorIO config")},
       {"ocio", Text("that config: a file, or a built-in one such as ocio://default; else that of "
                     "the environment variable OCIO")},
       {"views", {{"type", "integer"}, {"minimum", 2}, {"maximum", 400}, {"default", 40}}},
       {"holdout", {{"type", "integer"}, {"minimum", 0}, {"maximum", 1000000}, {"default", 0}}}},
      {"splat"});
  const Json outputs =
      Object({{"splats", {{"type", "array"}, {"items", Text("in the format of its extension")}}},
              {"report", Text("a .json file")},
              {"report_html", Text("an .html file, to look at")},
              {"masks", Text("a folder: <region>/<mask of a picture>")},
              {"mask_names", {{"enum", kMaskNames}, {"default", kMaskNames[0]}}},
              {"photos", Text("a folder: images/ with the edited photos, masks/ beside them")},
              {"views", Text("a folder: <image name>.png of the recolored scene")},
              {"session", Text("a folder NAME.retint, to go on in the editor")},
              {"finer_splat",
               Text("a .ply: the scene's splat with the Gaussians that \"refine\" made and its "
                    "colors as they were, which \"session\" then refers to")}});
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "A job of retint run; relative paths start in its folder"}};
  schema.update(
      Object({{"$schema", Json::object()},
              {"retint_job", {{"const", 1}}},
              {"scene", scene},
              {"preset", {{"enum", Presets()}}},
              {"seed", {{"type", "integer"}, {"minimum", 0}, {"default", 0}}},
              {"options", OptionsSchema(Described(options))},
              {"regions", {{"type", "array"}, {"minItems", 1}, {"items", RegionSchema()}}},
              {"outputs", outputs}},
             {"retint_job", "scene", "regions", "outputs"}));
  return schema.dump(2) + "\n";
}

}  // namespace retint
