// SPDX-License-Identifier: BSD-3-Clause
#include "retint/file_checks.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/error.h"
#include "base/staged_output.h"
#include "recolor/edit_text.h"
#include "retint/common.h"
#include "splat_io/splat_io.h"

namespace retint::cli {
namespace {

// The options of a verb that name files, with the files that were given. --splat is one of the
// scene.
struct FileOptions {
  std::vector<NamedFile> written, folders, pictures, read;
  std::set<std::string> views;
};

FileOptions FilesOf(const CLI::App& verb) {
  constexpr std::string_view kWritten[] = {"--output",      "OUTPUT",       "--report",
                                           "--report-html", "--comparison", "--transform",
                                           "--png",         "--picture"};
  constexpr std::string_view kFolders[] = {"--output", "--save-stages", "--photos"};
  constexpr std::string_view kPictures[] = {"--mask", "--scribble", "--scribble-outside", "--erase",
                                            "--edited"};
  constexpr std::string_view kWithStrength[] = {"--edited", "--lut"};
  const auto is_one = [](const auto& names, const std::string& name) {
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
  };
  FileOptions files;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_name() == "--view") {
      files.views.insert(option->results().begin(), option->results().end());
    }
    const std::string name = option->get_name(), type = option->get_type_name();
    const bool is_file = type.find("FILE") != std::string::npos && name != "--splat";
    for (const std::string& value : option->results()) {
      // Of NAME=FILE and FILE,strength=S the file.
      const size_t sign = type.starts_with("NAME=") ? value.find('=') : std::string::npos;
      NamedFile file{name, sign == std::string::npos ? value : value.substr(sign + 1)};
      if (is_one(kWithStrength, name)) file.path = FileOf(file.path.string());
      if (file.path.empty()) continue;
      if (is_file && is_one(kWritten, name)) {
        files.written.push_back(file);
      } else if (is_file) {
        files.read.push_back(file);
        if (is_one(kPictures, name)) files.pictures.push_back(file);
      } else if (type == "FOLDER" && is_one(kFolders, name)) {
        files.folders.push_back(file);
      }
    }
  }
  return files;
}

bool IsOneFile(const NamedFile& a, const NamedFile& b) {
  std::error_code code;
  return std::filesystem::equivalent(a.path, b.path, code);
}

// Whether the output of one of the views, FOLDER/<image name>.png, may be `path`.
bool IsOfView(std::string_view path, const std::set<std::string>& views) {
  constexpr std::string_view kPng = ".png";
  if (!path.ends_with(kPng)) return false;
  path.remove_suffix(kPng.size());
  return std::any_of(views.begin(), views.end(), [&](const std::string& view) {
    const std::string name = std::filesystem::path(view).lexically_normal().generic_string();
    return path == name || path.ends_with("/" + name);
  });
}

// --report page.html and --report splat.ply are slips of the hand.
void CheckExtension(const NamedFile& file) {
  const std::string extension = ExtensionOf(file.path);
  CheckOption(file.name != "--report" || extension == ".json",
              "--report writes JSON: " + file.path.string() + " is not a .json");
  CheckOption(file.name != "--report-html" || extension == ".html" || extension == ".htm",
              "--report-html writes a page: " + file.path.string() + " is not an .html");
}

// The splats that are read, with all their files. The fault of one is reported when it is read.
void AddSplats(const std::vector<NamedFile>& read, InputGuard* guard) {
  for (const NamedFile& file : read) {
    if (file.name != "--splat" && file.name != "--like" && file.name != "INPUT") continue;
    std::vector<std::filesystem::path> files = {file.path};
    try {
      files = SplatFiles(file.path);
    } catch (const InputError&) {
    }
    guard->AddSplat(file.path, files);
  }
}

}  // namespace

void CheckFiles(const CLI::App& verb, const SceneArguments* scene, InputGuard* guard) {
  constexpr std::string_view kMadeFrom[][2] = {
      {"recolor", "--splat"}, {"refit", "--splat"},   {"align", "--splat"}, {"match", "--splat"},
      {"convert", "INPUT"},   {"select", "--append"}, {"mask", "--mask"}};
  FileOptions files = FilesOf(verb);
  // A splat that was found counts as one that was named.
  if (scene && !scene->splat.empty()) files.read.push_back({"--splat", scene->splat});
  CheckApart(files.written, {});
  for (const NamedFile& folder : files.folders) {
    std::vector<NamedFile> written = files.written;
    written.push_back(folder);
    CheckApart(written, {});
  }
  AddSplats(files.read, guard);
  for (const NamedFile& file : files.written) {
    std::vector<NamedFile> read = files.read;
    if (file.name == "--output" || file.name == "OUTPUT") {
      std::erase_if(read, [&](const NamedFile& other) {
        const bool made_from = std::any_of(
            std::begin(kMadeFrom), std::end(kMadeFrom),
            [&](const auto& pair) { return pair[0] == verb.get_name() && pair[1] == other.name; });
        if (made_from && IsOneFile(file, other)) {
          guard->Allow(file.path);
          guard->AllowSplat(file.path);
        }
        return made_from;
      });
    }
    CheckApart({file}, read);
    CheckExtension(file);
    guard->Plan(file.name, file.path);
  }
  for (const NamedFile& folder : files.folders) {
    for (const NamedFile& picture : files.pictures) {
      std::error_code code;
      const auto below = std::filesystem::relative(picture.path, folder.path, code);
      if (code || below.empty() || *below.begin() == "..") continue;
      if (!IsOfView(below.generic_string(), files.views)) continue;
      throw OptionError(folder.name + " would replace what " + picture.name + " names, " +
                        picture.path.string() + ", which lies in that folder");
    }
  }
}

}  // namespace retint::cli
