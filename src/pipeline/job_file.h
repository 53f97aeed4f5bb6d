// SPDX-License-Identifier: BSD-3-Clause
// A job file: one scene, regions and what is done to each, and the files that come out of it, as
// JSON that people and scripts write (docs/pipelines.md; its schema is JobSchema()).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "editing/edit_options.h"
#include "recolor/color_edit.h"
#include "recolor/finer_gaussians.h"

namespace retint {

struct JobPaint {
  std::string view;            // name of an image of the workspace
  std::filesystem::path mask;  // brush mask of that view
};

// Selected by paint, or by masks that were made elsewhere: one of the three is not empty.
struct JobRegion {
  std::string name;
  std::vector<JobPaint> paint;
  std::filesystem::path mask_folder;                   // <image name>.png of each view
  std::map<std::string, std::filesystem::path> masks;  // by image name
  EditOptions options;                                 // its refit is the job's
  ColorEdit edit;
  float strength = 1;
  std::optional<RefineOptions> refine;  // split large Gaussians before the fits
};

// Empty: not written.
struct JobOutputs {
  std::vector<std::filesystem::path> splats;  // each in the format of its extension
  std::filesystem::path report;               // .json
  std::filesystem::path page;                 // .html, to look at
  std::filesystem::path masks;                // folder: <region's name>/<image name>.png
  std::filesystem::path views;                // folder: <image name>.png of the recolored scene
  std::filesystem::path session;              // folder NAME.retint, to go on in the editor
  std::filesystem::path finer_splat;          // .ply: with Gaussians split and no color changed
};

struct Job {
  std::filesystem::path file;  // where it was read from; relative paths start in its folder
  std::filesystem::path workspace, splat, images;  // no workspace: views are placed
  std::string model;                               // of the workspace; empty: the largest
  std::string world_from_splat;  // as WorldFromSplatOf() reads it; empty: the same frame
  int views = 0;                 // that are placed; 0: as many as without a job
  int holdout = 0;
  uint64_t seed = 0;
  EditOptions options;             // of every region that does not say otherwise
  std::vector<JobRegion> regions;  // in the order in which their edits apply; names are unique
  JobOutputs outputs;
  std::vector<std::string> warnings;  // of what is not quite as it was asked for, a sentence each
};

// Paths are made absolute. InputError "FILE:LINE: KEY: fault" for text that is not JSON, keys that
// do not exist, values out of range, and files of edits that cannot be read.
// `seed`, where given, takes the place of the job's.
Job ReadJob(const std::filesystem::path& path, std::optional<uint64_t> seed = std::nullopt);

// The JSON Schema (draft 2020-12) of a job file, made from the same descriptions of options and
// operations that ReadJob() checks against.
std::string JobSchema();

}  // namespace retint
