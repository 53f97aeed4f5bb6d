// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/edit_checks.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/ranks.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "colmap_io/mask_names.h"
#include "reporting/export_photos.h"
#include "saving/session_file.h"
#include "splat_io/splat_io.h"
#include "splat_io/streamed_sog.h"

namespace retint {

namespace fs = std::filesystem;

void CheckOutputs(const EditRecipe& recipe) {
  if (!CurrentRanks().IsRoot()) return;
  const EditOutputs& outputs = recipe.outputs;
  for (const fs::path& splat : outputs.splats) {
    CodecForWriting(splat);
    CheckOutput(splat);
  }
  for (const fs::path& file :
       {outputs.report, outputs.page, outputs.comparison, outputs.finer_splat}) {
    if (!file.empty()) CheckOutput(file);
  }
  for (const fs::path& folder :
       {outputs.masks, outputs.views, outputs.photos, outputs.stages, outputs.session}) {
    if (!folder.empty()) CheckOutput(folder, /*as_folder=*/true);
  }
  if (!outputs.session.empty()) SessionWriter(outputs.session).CheckFolder();
  std::error_code ignored;
  for (const auto& [folder, name] :
       {std::pair(outputs.stages, "the stages is the workspace, whose masks it"),
        std::pair(outputs.photos, "the edited photos is the workspace, whose photos it")}) {
    CheckOption(!fs::equivalent(folder, recipe.workspace, ignored),
                "the folder of " + std::string(name) + " would replace: name another folder");
  }
}

void CheckSteps(const EditRecipe& recipe, const SceneSource& scene) {
  const EditOutputs& outputs = recipe.outputs;
  const auto refines = [&] {
    return std::ranges::any_of(recipe.regions,
                               [](const RegionRecipe& one) { return one.refine.has_value(); });
  };
  if (scene.IsWhole()) {
    for (const fs::path& splat : outputs.splats) {
      CheckStreamedSog(splat, scene.session().scene().original());
      CheckOption(!IsStreamedSog(splat) || !refines(),
                  splat.string() + ": a streamed SOG keeps its Gaussians, so none can be split");
    }
    return;
  }
  for (const fs::path& splat : outputs.splats) {
    CheckOption(CodecForWriting(splat).Name() == "3DGS .ply",
                "a splat that is opened in parts is written as a patched copy: " + splat.string() +
                    " must be a 3DGS .ply");
  }
  for (const fs::path& folder :
       {outputs.masks, outputs.views, outputs.photos, outputs.stages, outputs.session}) {
    CheckOption(folder.empty(),
                folder.string() + " needs all views of the scene, and it is opened in parts");
  }
  CheckOption(!refines(), "Gaussians are split of a splat that is opened whole");
  CheckOption(std::ranges::none_of(recipe.regions,
                                   [](const RegionRecipe& one) { return one.match.has_value(); }),
              "colors are matched of a splat that is opened whole");
}

void PlanOutputs(const EditRecipe& recipe, const SceneSource& scene, InputGuard& inputs) {
  const EditOutputs& outputs = recipe.outputs;
  const Pictures pictures = scene.pictures();
  inputs.Add(recipe.file);
  for (const fs::path& splat : outputs.splats) {
    inputs.AllowSplat(splat);
    inputs.Plan("outputs.splats", splat);
  }
  for (const auto& [name, file] :
       {std::pair("outputs.report", outputs.report), std::pair("outputs.report_html", outputs.page),
        std::pair("outputs.comparison", outputs.comparison),
        std::pair("outputs.finer_splat", outputs.finer_splat)}) {
    if (!file.empty()) inputs.Plan(name, file);
  }
  for (const fs::path& file :
       PhotoExportFiles(scene.workspace(), outputs.photos, outputs.mask_names)) {
    inputs.Plan("outputs.photos", file);
  }
  for (const UserPicture& picture : pictures.all()) {
    if (!outputs.views.empty()) {
      inputs.Plan("outputs.views", ViewFile(outputs.views, picture.name));
    }
    for (const RegionRecipe& region : recipe.regions) {
      if (outputs.masks.empty()) continue;
      const fs::path folder = outputs.masks / region.name,
                     mask = MaskFile(folder, picture.name, outputs.mask_names);
      std::error_code ignored;
      if (fs::equivalent(folder, region.mask_folder, ignored)) inputs.Allow(mask);
      inputs.Plan("outputs.masks", mask);
    }
  }
}

}  // namespace retint
