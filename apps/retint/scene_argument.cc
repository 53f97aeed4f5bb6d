// SPDX-License-Identifier: BSD-3-Clause
// The scene of a verb: one argument that is a workspace, a splat, a session or a job.
#include "base/error.h"
#include "base/files.h"
#include "colmap_io/nerfstudio.h"
#include "opening/find_splat.h"
#include "pipeline/job_file.h"
#include "retint/common.h"
#include "retint/help.h"
#include "saving/session_file.h"

namespace retint::cli {
namespace {

namespace fs = std::filesystem;

bool IsSession(const fs::path& path) { return IsFile(path / "session.json"); }

// Not the meta.json of an unpacked .sog.
bool IsJob(const fs::path& path) {
  return ExtensionOf(path) == ".json" &&
         path.filename().string().find("meta.json") == std::string::npos;
}

// Other files of this extension belong to a workspace, as transforms.json does.
EditRecipe ReadJobOf(const fs::path& path) {
  if (ReadFile(path).find("\"retint_job\"") == std::string::npos) {
    throw InputError(path, "is not a job of Retint: name the folder that it is in");
  }
  return ReadJob(path);
}

bool PlacesViews(const SceneArguments& scene) {
  return scene.views_flag && scene.views_flag->count() > 0;
}

// The scene of a session or a job, unless a flag says otherwise.
void TakeOver(const fs::path& from, fs::path* to) {
  if (to->empty()) *to = from;
}

void FindInSession(const fs::path& folder, SceneArguments* scene) {
  const SessionInfo info = ReadSessionInfo(folder);
  scene->workspace = info.workspace;
  scene->view_folder = info.view_folder;
  TakeOver(info.splat, &scene->splat);
  TakeOver(info.image_folder, &scene->images);
  if (scene->model.empty()) scene->model = info.model;
  scene->place = info.world_from_splat;
  if (scene->render_model.empty() && info.render_model) {
    scene->render_model = NameOf(*info.render_model);
  }
  if (scene->space == OcioSpace()) scene->space = info.space;
}

void FindInWorkspace(const fs::path& folder, SceneArguments* scene) {
  scene->workspace = folder;
  if (!scene->splat.empty()) return;
  if (const auto found = FindSplat(folder)) {
    scene->splat = *found;
  } else if (scene->needs_splat) {
    throw InputError(folder, "holds " + SplatsText(folder) + ": name one with --splat");
  }
}

}  // namespace

std::string SplatsText(const fs::path& workspace) {
  constexpr size_t kMost = 8;
  const std::vector<fs::path> splats = SplatsIn(workspace);
  if (splats.empty()) return "no splat";
  std::string text;
  for (size_t i = 0; i < splats.size() && i < kMost; ++i) {
    text += (i == 0 ? "" : ", ") + splats[i].filename().string();
  }
  return std::to_string(splats.size()) + " splats (" + text +
         (splats.size() > kMost ? ", ..." : "") + ")";
}

void TakeScene(const EditRecipe& recipe, SceneArguments& scene) {
  scene.workspace = recipe.workspace;
  TakeOver(recipe.splat, &scene.splat);
  TakeOver(recipe.images, &scene.images);
  if (scene.model.empty()) scene.model = recipe.model;
  if (scene.world_from_splat.empty()) scene.world_from_splat = recipe.world_from_splat;
  if (scene.render_model.empty() && recipe.render_model) {
    scene.render_model = NameOf(*recipe.render_model);
  }
  if (scene.space == OcioSpace()) scene.space = recipe.space;
  if (recipe.views > 0 && !PlacesViews(scene)) scene.views = recipe.views;
}

void FindScene(SceneArguments& scene) {
  const fs::path& path = scene.path;
  if (path.empty()) return;
  std::error_code code;
  if (!fs::exists(path, code)) {
    throw InputError(path, code ? code.message() : "there is no such file or folder");
  }
  if (IsSession(path)) {
    FindInSession(path, &scene);
  } else if (fs::is_directory(path)) {
    FindInWorkspace(path, &scene);
  } else if (IsJob(path)) {
    TakeScene(ReadJobOf(path), scene);
  } else {
    CheckOption(scene.splat.empty(),
                "--splat names the splat of a workspace, but " + path.string() + " is a file");
    scene.splat = path;
  }
  const bool alone = scene.workspace.empty();
  CheckOption(!alone || (scene.images.empty() && scene.model.empty()),
              "--images and --model are parts of a workspace, which a splat alone has not");
  CheckOption((alone && scene.view_folder.empty()) || !PlacesViews(scene),
              "--views places views around a splat alone; " + path.string() + " has its own");
}

CLI::Option* AddRenderModel(CLI::App* verb, std::string& name) {
  return verb
      ->add_option("--render-model", name,
                   "How the splat was trained: mip with an antialiasing filter (Mip-Splatting, "
                   "gsplat's antialiased), default without. Else as its files say")
      ->check(CLI::IsMember({"default", "mip"}));
}

void AddSceneFiles(CLI::App* verb, Globals& globals, SceneArguments& scene, bool needs_splat) {
  scene.needs_splat = needs_splat;
  globals.scenes[verb] = &scene;
  verb->add_option("SCENE", scene.path,
                   "Workspace, splat, session (NAME.retint, without its regions) or job")
      ->required()
      ->type_name("SCENE");
  AddPath(verb, "-s,--splat", scene.splat,
          "Splat of the workspace, if it holds several or lies elsewhere")
      ->group(kSceneGroup);
  AddPath(verb, "--images", scene.images, "Folder of the photos, if Retint does not find it",
          "FOLDER")
      ->group(kSceneGroup);
  verb->add_option("--model", scene.model,
                   "Sparse model of the workspace, such as 1 or dense/0. Else the largest")
      ->type_name("NAME")
      ->group(kSceneGroup);
}

void AddScene(CLI::App* verb, Globals& globals, SceneArguments& scene, bool needs_splat) {
  AddSceneFiles(verb, globals, scene, needs_splat);
  verb->add_option("--world-from-splat", scene.world_from_splat,
                   "Where the splat lies in the workspace's world: a JSON file (nerfstudio's "
                   "dataparser_transforms.json, or that of `retint align`), or the 12 or 16 "
                   "numbers of a matrix, by rows")
      ->type_name("FILE|NUMBERS")
      ->group(kSceneGroup);
  AddRenderModel(verb, scene.render_model)->group(kSceneGroup);
  verb->add_option("--space", scene.space.name,
                   "Color space of the splat's colors, by its name in an OpenColorIO config, such "
                   "as ACEScct. Edits work on sRGB, the splat stays in its space")
      ->type_name("NAME")
      ->group(kSceneGroup);
  verb->add_option("--ocio", scene.space.config,
                   "OpenColorIO config of --space: a file, or a built-in one such as "
                   "ocio://default. Else that of $OCIO")
      ->type_name("CONFIG")
      ->group(kSceneGroup);
  scene.views_flag = verb->add_option("--views", scene.views, "Views to place around a splat alone")
                         ->check(CLI::Range(2, 400))
                         ->group(kSceneGroup);
  verb->add_option("--pixels", scene.pixels,
                   "Pixels of masks, renders and depth maps if a camera is distorted: those of "
                   "the photo, or of the undistorted views (pinhole)")
      ->check(CLI::IsMember({"photo", "pinhole"}))
      ->group(kSceneGroup);
}

SessionOptions OptionsOf(const SceneArguments& scene, int holdout, const Run& run) {
  SessionOptions options;
  options.backend = run.globals().backend;
  options.cache_bytes = run.globals().cache_mb << 20;
  options.image_folder = scene.images;
  options.model = scene.model;
  options.views = scene.views;
  options.view_folder = scene.view_folder;
  options.world_from_splat = scene.place;
  if (!scene.world_from_splat.empty()) {
    CheckOption(!scene.workspace.empty(), "--world-from-splat needs a workspace");
    options.world_from_splat = WorldFromSplatOf(scene.world_from_splat);
  }
  if (!scene.render_model.empty()) options.render_model = ChosenRenderModel(scene.render_model);
  options.space = scene.space;
  options.pixels = scene.pixels == "pinhole" ? Pixels::kPinhole : Pixels::kPhoto;
  options.holdout = holdout;
  return options;
}

}  // namespace retint::cli
