// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/job_file.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/option_json.h"
#include "base/staged_output.h"
#include "recolor/edit_text.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using json::Json;
using json::Node;

constexpr int kJobVersion = 1;
constexpr size_t kLongestName = 200;  // bytes of a region's name; file systems allow folders 255

class JobReader {
 public:
  explicit JobReader(const fs::path& path)
      : path_(path),
        folder_(fs::absolute(path).parent_path()),
        json_(json::ParseWithLines(ReadFile(path), path, &lines_)) {}

  EditRecipe Read(std::optional<uint64_t> seed);

 private:
  fs::path Path(const Node& node) const;
  fs::path OptionalPath(const Node& parent, const char* key) const;
  // `options` changed by the entries of `parent`'s "options".
  EditOptions Options(const Node& parent, EditOptions options, bool with_refit) const;
  RefineOptions Refine(const Node& node) const;
  void Scene(const Node& node, EditRecipe* job) const;
  // Adds sentences for people to the job's warnings.
  RegionRecipe Region(const Node& node, EditRecipe& job) const;
  void Selection(const Node& node, RegionRecipe* region) const;
  MatchRecipe Match(const Node& node) const;
  ColorEdit Edit(const Node& node, std::vector<std::string>* warnings) const;
  EditOutputs Outputs(const Node& node) const;
  void CheckFiles(const EditRecipe& job, const Node& node) const;

  const fs::path path_;
  const fs::path folder_;
  json::LineIndex lines_;
  const Json json_;
};

fs::path JobReader::Path(const Node& node) const {
  const std::string text = node.Text();
  if (text.empty()) node.Fail("is empty");
  if (text.find('\0') != std::string::npos) node.Fail("holds a zero byte");
  return (folder_ / text).lexically_normal();
}

fs::path JobReader::OptionalPath(const Node& parent, const char* key) const {
  return parent.Has(key) ? Path(parent.At(key)) : fs::path();
}

EditOptions JobReader::Options(const Node& parent, EditOptions options, bool with_refit) const {
  if (!parent.Has("options")) return options;
  const Node node = parent.At("options");
  OptionList list;
  if (with_refit) {
    options.Describe(list);
  } else {
    options.select.Describe(list);
    options.projector.Describe(list);
  }
  json::AllowOnlyOptions(node, list);
  json::ReadOptions(node, list);
  try {
    options.Check();
  } catch (const OptionError& error) {
    node.Fail(error.what());
  }
  return options;
}

RefineOptions JobReader::Refine(const Node& node) const {
  RefineOptions options;
  OptionList list;
  options.Describe(list);
  json::AllowOnlyOptions(node, list);
  json::ReadOptions(node, list);
  return options;
}

void JobReader::Scene(const Node& node, EditRecipe* job) const {
  node.AllowOnly({"workspace", "splat", "images", "model", "world_from_splat", "render_model",
                  "space", "ocio", "views", "holdout"});
  job->workspace = OptionalPath(node, "workspace");
  job->splat = Path(node.At("splat"));
  job->images = OptionalPath(node, "images");
  for (const char* const name : {"images", "model", "world_from_splat"}) {
    if (job->workspace.empty() && node.Has(name)) node.At(name).Fail("needs a workspace");
  }
  if (node.Has("views")) {
    if (!job->workspace.empty()) node.At("views").Fail("a workspace has its own views");
    job->views = int(node.At("views").Int(2, 400));
  }
  if (node.Has("model")) job->model = node.At("model").Text();
  if (node.Has("world_from_splat")) {
    // Numbers, or a file that holds them.
    job->world_from_splat = node.At("world_from_splat").Text();
    const fs::path file = Path(node.At("world_from_splat"));
    if (IsFile(file)) job->world_from_splat = file.string();
  }
  if (node.Has("render_model")) {
    job->render_model = ChosenRenderModel(node.At("render_model").Text());
    if (!job->render_model) node.At("render_model").Fail("is not default or mip");
  }
  if (node.Has("space")) job->space.name = node.At("space").Text();
  if (node.Has("ocio")) {
    if (job->space.name.empty()) node.At("ocio").Fail("needs \"space\"");
    job->space.config = node.At("ocio").Text();
    if (!job->space.config.starts_with("ocio://"))
      job->space.config = Path(node.At("ocio")).string();
  }
  if (node.Has("holdout")) {
    job->holdout = node.At("holdout").Int(0, 1000000);
    if (job->holdout == 1) node.At("holdout").Fail("must be 0 (none) or at least 2");
  }
}

void JobReader::Selection(const Node& node, RegionRecipe* region) const {
  if (node.Has("paint") == node.Has("masks")) {
    node.Fail("a region has either \"paint\" or \"masks\"");
  }
  if (node.Has("paint")) {
    std::set<std::string> views;
    for (const Node& paint : node.At("paint").List()) {
      paint.AllowOnly({"view", "mask"});
      region->paint.push_back({paint.At("view").Bytes(), Path(paint.At("mask"))});
      if (!views.insert(region->paint.back().view).second) {
        paint.At("view").Fail("the view is painted twice");
      }
    }
    if (region->paint.empty()) node.At("paint").Fail("names no painted view");
    return;
  }
  const Node masks = node.At("masks");
  if (masks.json().is_string()) {
    region->mask_folder = Path(masks);
    region->invert_masks = node.Has("invert_masks") && node.At("invert_masks").Bool();
    return;
  }
  if (!masks.json().is_object()) {
    masks.Fail("is neither a folder nor an object of files by image name");
  }
  for (const auto& [name, unused] : masks.json().items()) {
    region->masks.emplace(UnescapeBytes(name), Path(masks.At(name.c_str())));
  }
  if (region->masks.empty()) masks.Fail("names no mask");
}

MatchRecipe JobReader::Match(const Node& node) const {
  node.AllowOnly({"map", "like", "gray", "checker"});
  MatchRecipe match;
  match.like = OptionalPath(node, "like");
  for (const auto& [key, text] : {std::pair("map", &match.map), std::pair("gray", &match.gray),
                                  std::pair("checker", &match.checker)}) {
    if (node.Has(key)) *text = node.At(key).Bytes();
  }
  try {
    match.Check();
  } catch (const OptionError& error) {
    node.Fail(error.what());
  }
  return match;
}

ColorEdit JobReader::Edit(const Node& node, std::vector<std::string>* warnings) const {
  try {
    if (node.json().is_string()) return ReadEdit(Path(node), warnings);
    return EditFromJson(node.json().dump(), folder_, warnings);
  } catch (const OptionError& error) {
    node.Fail(error.what());
  } catch (const InputError& error) {
    node.Fail(error.what());
  }
}

RegionRecipe JobReader::Region(const Node& node, EditRecipe& job) const {
  const bool matches = node.Has("match");
  if (matches) {
    node.AllowOnly({"name", "match", "strength"});
  } else {
    node.AllowOnly(
        {"name", "paint", "masks", "invert_masks", "edit", "strength", "options", "refine"});
  }
  RegionRecipe region;
  region.name = node.At("name").Text();
  // It names a folder of masks.
  const bool plain = !region.name.empty() && region.name != "." && region.name != ".." &&
                     region.name.find_first_of(std::string_view("/\\\0", 3)) == std::string::npos;
  if (!plain) node.At("name").Fail("is empty or holds a slash");
  if (region.name.size() > kLongestName) {
    node.At("name").Fail("has more than " + std::to_string(kLongestName) + " bytes");
  }
  std::vector<std::string> warnings;
  if (matches) {
    region.match = Match(node.At("match"));
  } else {
    Selection(node, &region);
    region.edit = Edit(node.At("edit"), &warnings);
    if (region.edit.operations.empty()) node.At("edit").Fail("has no operation");
  }
  for (const std::string& warning : warnings) {
    job.warnings.push_back("region '" + region.name + "': " + warning);
  }
  if (node.Has("strength")) {
    region.strength = node.At("strength").Float();
    if (region.strength < 0 || region.strength > 1) node.At("strength").Fail("is not in [0, 1]");
  }
  region.options = Options(node, job.options, /*with_refit=*/false);
  if (node.Has("refine")) region.refine = Refine(node.At("refine"));
  return region;
}

EditOutputs JobReader::Outputs(const Node& node) const {
  node.AllowOnly({"splats", "report", "report_html", "masks", "mask_names", "photos", "views",
                  "session", "finer_splat"});
  EditOutputs outputs;
  std::set<fs::path> seen;
  if (node.Has("splats")) {
    for (const Node& splat : node.At("splats").List()) {
      outputs.splats.push_back(Path(splat));
      if (!seen.insert(outputs.splats.back()).second) splat.Fail("comes twice");
    }
  }
  outputs.report = OptionalPath(node, "report");
  outputs.page = OptionalPath(node, "report_html");
  outputs.masks = OptionalPath(node, "masks");
  if (node.Has("mask_names")) {
    try {
      outputs.mask_names = MaskNamesOf(node.At("mask_names").Text());
    } catch (const OptionError& error) {
      node.At("mask_names").Fail(error.what());
    }
  }
  outputs.photos = OptionalPath(node, "photos");
  outputs.views = OptionalPath(node, "views");
  outputs.session = OptionalPath(node, "session");
  outputs.finer_splat = OptionalPath(node, "finer_splat");
  if (node.json().empty()) node.Fail("names nothing to write");
  return outputs;
}

// No output replaces another or an input of the job, apart from the scene's own splat. A session
// has its folder for itself.
void JobReader::CheckFiles(const EditRecipe& job, const Node& node) const {
  std::vector<NamedFile> written, read = {{"this job", job.file}};
  const auto add = [](std::vector<NamedFile>* files, const char* name, const fs::path& path) {
    if (!path.empty()) files->push_back({name, path});
  };
  for (const RegionRecipe& region : job.regions) {
    for (const PaintFile& paint : region.paint) add(&read, "a mask", paint.mask);
    for (const auto& [image, mask] : region.masks) add(&read, "a mask", mask);
    if (region.match) add(&read, "the splat of \"like\"", region.match->like);
  }
  for (const fs::path& splat : job.outputs.splats) add(&written, "one of splats", splat);
  try {
    CheckApart(written, read);
    add(&written, "finer_splat", job.outputs.finer_splat);
    add(&written, "report", job.outputs.report);
    add(&written, "report_html", job.outputs.page);
    CheckApart(written, read);
    add(&read, "the scene's splat", job.splat);
    std::erase_if(written, [](const NamedFile& file) { return file.name == "one of splats"; });
    CheckApart(written, read);
    for (const fs::path& splat : job.outputs.splats) add(&written, "one of splats", splat);
    for (const auto& [name, folder] :
         {std::pair("masks", job.outputs.masks), std::pair("photos", job.outputs.photos),
          std::pair("views", job.outputs.views), std::pair("session", job.outputs.session)}) {
      std::vector<NamedFile> with_folder = written;
      add(&with_folder, name, folder);
      CheckApart(with_folder, {});
    }
  } catch (const OptionError& error) {
    node.Fail(error.what());
  }
  const fs::path &report = job.outputs.report, &page = job.outputs.page;
  if (!report.empty() && report.extension() != ".json") node.At("report").Fail("is not a .json");
  if (!page.empty() && page.extension() != ".html") node.At("report_html").Fail("is not an .html");
  const fs::path &session = job.outputs.session, &finer = job.outputs.finer_splat;
  const bool refines = std::ranges::any_of(
      job.regions, [](const RegionRecipe& region) { return region.refine.has_value(); });
  if (!finer.empty()) {
    if (!refines) node.At("finer_splat").Fail("no region has \"refine\"");
    if (finer.extension() != ".ply") node.At("finer_splat").Fail("is not a .ply");
  } else if (refines && !session.empty()) {
    node.At("session").Fail(
        "needs \"finer_splat\" beside it: a session names the file of its splat, which \"refine\" "
        "makes another");
  }
  for (const auto& [name, folder] :
       {std::pair("masks", job.outputs.masks), std::pair("photos", job.outputs.photos),
        std::pair("views", job.outputs.views)}) {
    if (session.empty() || folder.empty()) continue;
    const fs::path below = session.lexically_relative(folder);
    if (!below.empty() && *below.begin() != "..") {
      node.At("session").Fail(std::string("lies in the folder of ") + name);
    }
  }
}

EditRecipe JobReader::Read(std::optional<uint64_t> seed) {
  const Node root(json_, path_, "", &lines_);
  root.AllowOnly(
      {"$schema", "retint_job", "scene", "preset", "seed", "options", "regions", "outputs"});
  const uint64_t version = root.At("retint_job").Unsigned();
  if (version != kJobVersion) {
    root.At("retint_job").Fail("this program reads version " + std::to_string(kJobVersion));
  }
  EditRecipe job;
  job.file = fs::absolute(path_).lexically_normal();
  job.title = job.file.stem().string();
  job.command = "retint run " + job.file.string();
  Scene(root.At("scene"), &job);
  if (root.Has("preset")) {
    try {
      job.options = PresetOptions(root.At("preset").Text());
    } catch (const OptionError& error) {
      root.At("preset").Fail(error.what());
    }
  }
  if (root.Has("seed")) job.seed = root.At("seed").Unsigned();
  job.seed = seed.value_or(job.seed);
  job.options.SetSeed(job.seed);
  job.options = Options(root, job.options, /*with_refit=*/true);
  job.options.EndByThemselves();
  std::set<std::string> names;
  for (const Node& node : root.At("regions").List()) {
    job.regions.push_back(Region(node, job));
    if (!names.insert(job.regions.back().name).second) node.At("name").Fail("comes twice");
  }
  if (job.regions.empty()) root.At("regions").Fail("there is no region");
  job.outputs = Outputs(root.At("outputs"));
  CheckFiles(job, root.At("outputs"));
  return job;
}

}  // namespace

EditRecipe ReadJob(const fs::path& path, std::optional<uint64_t> seed) {
  return JobReader(path).Read(seed);
}

}  // namespace retint
