// SPDX-License-Identifier: BSD-3-Clause
// The recipe of an edit: one scene, regions with an edit each, and the files that come out of it.
// Flags of the command line and the keys of a job file both become one; EditRun
// (pipeline/edit_run.h) carries it out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "colmap_io/mask_names.h"
#include "editing/edit_options.h"
#include "editing/match_scene.h"
#include "recolor/color_edit.h"
#include "recolor/finer_gaussians.h"
#include "scene/splat_traits.h"

namespace retint {

struct PaintFile {
  std::string view;            // name of a picture of the workspace
  std::filesystem::path mask;  // brush mask of that picture
};

// Selected by paint, by masks that were made elsewhere, or, if there are neither, by the changes in
// the pictures of the edit. A match is everything, and its edit is found.
struct RegionRecipe {
  std::string name;
  std::vector<PaintFile> paint;
  std::filesystem::path mask_folder;                   // a mask of each picture, by its name
  bool invert_masks = false;                           // their black is inside
  std::map<std::string, std::filesystem::path> masks;  // by picture name
  EditOptions options;                                 // its refit is the recipe's
  std::optional<MatchRecipe> match;
  ColorEdit edit;  // without a match
  float strength = 1;
  std::optional<RefineOptions> refine;  // split large Gaussians before the fits
};

// Empty: not written.
struct EditOutputs {
  std::vector<std::filesystem::path> splats;  // each in the format of its extension
  std::filesystem::path report;               // .json
  std::filesystem::path page;                 // .html, to look at
  std::filesystem::path comparison;           // .png: before, mask and after of some views
  std::filesystem::path masks;                // folder: <region's name>/<mask of a picture>
  std::filesystem::path photos;               // folder: images/ and masks/, ExportPhotos()
  MaskNames mask_names = MaskNames::kColmap;  // of both
  std::filesystem::path views;                // folder: <picture name>.png of the recolored scene
  std::filesystem::path stages;               // folder: the results of every stage
  std::filesystem::path session;              // folder NAME.retint, to go on in the editor
  std::filesystem::path finer_splat;          // .ply: with Gaussians split and no color changed
};

struct EditRecipe {
  std::string title,
      command;  // of the page: its heading, and the command that makes the same again
  std::filesystem::path file;  // where it was read from, if it was: paths start in its folder
  std::filesystem::path workspace, splat, images;  // no workspace: views are placed
  std::string model;                               // of the workspace; empty: the largest
  std::string world_from_splat;             // as WorldFromSplatOf() reads it; empty: the same frame
  std::optional<RenderModel> render_model;  // instead of the splat's
  OcioSpace space;                          // of the splat's colors; no name: as the splat says
  int views = 0;                            // that are placed; 0: as many as without a recipe
  int holdout = 0;
  uint64_t seed = 0;
  EditOptions options;                // of every region that does not say otherwise
  std::vector<RegionRecipe> regions;  // in the order in which their edits apply; unique names
  EditOutputs outputs;
  std::vector<std::string> warnings;  // a sentence for each part that differs from the request
};

}  // namespace retint
