// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/streamed_sog.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <map>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/input_file.h"
#include "base/staged_output.h"
#include "splat_io/json.h"
#include "splat_io/sog_codec.h"
#include "splat_io/sog_files.h"
#include "splat_io/sog_writer.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::string_view kFileName = "lod-meta.json";
constexpr const char* kMark = "streamed SOG 1";  // of SourceLayout::packed_format
constexpr uint64_t kMostLevels = 64;
constexpr uint64_t kMostGaussians = uint64_t{1} << 32;  // so that sums do not overflow
// A leaf takes about 25 values. A tree with half a million leaves is 20 deep, with two values a
// level.
constexpr JsonLimits kLimits = {.depth = 256, .values = size_t{1} << 24};
constexpr int kEnvironment = -1;

struct Chunk {
  std::string name;    // of its meta.json, below the folder
  int level = 0;       // or kEnvironment
  uint64_t count = 0;  // by the tree; unknown for the environment
};

// The parsed lod-meta.json.
class Index {
 public:
  explicit Index(fs::path path) : path_(std::move(path)) {
    const Json meta = ParseJson(ReadFile(path_), path_, std::string(kFileName), kLimits);
    if (const Json* version = Member(meta, "version"); version && *version != 1) {
      Fail("is of version " + (version->is_number() ? version->dump() : "?") +
           ", which is not supported; supported: 1");
    }
    levels_ = static_cast<int>(Whole(Member(meta, "lodLevels"), "lodLevels", kMostLevels));
    if (levels_ == 0) Fail("has no level of detail");
    const Json* names = Member(meta, "filenames");
    if (!names || !names->is_array() || names->empty()) Fail("names no chunk");
    for (const Json& name : *names) chunks_.push_back({Name(name), 0, 0});
    ReadTree(Member(meta, "tree"));
    CheckCounts(meta);
    const Json* environment = Member(meta, "environment");
    if (environment && !environment->is_null()) {
      chunks_.push_back({Name(*environment), kEnvironment, 0});
    }
    std::set<std::string> seen;
    for (const Chunk& chunk : chunks_) {
      if (!seen.insert(chunk.name).second) Fail("names " + chunk.name + " twice");
    }
    if (std::ranges::none_of(chunks_, [](const Chunk& one) { return one.level == 0; })) {
      throw InputError(path_, "holds no Gaussians in its finest level");
    }
  }

  const fs::path& path() const { return path_; }
  int levels() const { return levels_; }
  const std::vector<Chunk>& chunks() const { return chunks_; }
  fs::path PathOf(const Chunk& chunk) const { return path_.parent_path() / chunk.name; }

  GaussianModel ReadChunk(const Chunk& chunk, Monitor& monitor, BadRows bad) const {
    GaussianModel model = SogCodec().Read(PathOf(chunk), monitor, bad);
    if (chunk.level != kEnvironment && chunk.count != model.NumGaussians()) {
      Fail("gives " + chunk.name + " " + std::to_string(chunk.count) + " Gaussians; it holds " +
           std::to_string(model.NumGaussians()));
    }
    return model;
  }

 private:
  [[noreturn]] void Fail(const std::string& fault) const {
    throw InputError(path_, std::string(kFileName) + " " + fault);
  }

  uint64_t Whole(const Json* value, const std::string& name, uint64_t most) const {
    if (!value || !value->is_number_unsigned() || value->get<uint64_t>() > most) {
      Fail("has no " + name + " from 0 to " + std::to_string(most));
    }
    return value->get<uint64_t>();
  }

  // Only names inside the folder.
  std::string Name(const Json& value) const {
    if (!value.is_string()) Fail("names a chunk by something else than text");
    const auto name = value.get<std::string>();
    const bool is_plain = std::ranges::none_of(name, [](char c) {
      return c == '\\' || c == ':' || static_cast<unsigned char>(c) < ' ' || c == '\x7f';
    });
    std::string_view rest = name;
    bool below = is_plain;
    while (below) {
      const size_t slash = rest.find('/');
      const std::string_view part = rest.substr(0, slash);
      below = !part.empty() && part[0] != '.';
      if (slash == std::string_view::npos) break;
      rest.remove_prefix(slash + 1);
    }
    if (!below) Fail("names a chunk that is no file below its folder");
    return name;
  }

  // Without recursion, because the tree may be deep.
  void ReadTree(const Json* root) {
    std::vector<const Json*> nodes = {root};
    std::map<size_t, std::vector<std::pair<uint64_t, uint64_t>>> runs;  // by chunk: offset, count
    std::vector<int> levels(chunks_.size(), -1);
    while (!nodes.empty()) {
      const Json* const node = nodes.back();
      nodes.pop_back();
      const Json* const children = node ? Member(*node, "children") : nullptr;
      const Json* const lods = node ? Member(*node, "lods") : nullptr;
      if (children && children->is_array()) {
        for (const Json& child : *children) nodes.push_back(&child);
        continue;
      }
      if (!lods || !lods->is_object()) Fail("has a tree node with neither children nor lods");
      for (const auto& [key, lod] : lods->items()) {
        int level = -1;
        std::from_chars(key.data(), key.data() + key.size(), level);
        if (level < 0 || level >= levels_ || std::to_string(level) != key) {
          Fail("has a tree node of a level that is not 0 to " + std::to_string(levels_ - 1));
        }
        const size_t file = Whole(Member(lod, "file"), "file in its tree", chunks_.size() - 1);
        if (levels[file] >= 0 && levels[file] != level) {
          Fail("has " + chunks_[file].name + " in two levels of detail");
        }
        levels[file] = level;
        runs[file].emplace_back(Whole(Member(lod, "offset"), "offset in its tree", kMostGaussians),
                                Whole(Member(lod, "count"), "count in its tree", kMostGaussians));
      }
    }
    for (size_t i = 0; i < chunks_.size(); ++i) {
      if (levels[i] < 0) Fail("has no part of " + chunks_[i].name + " in its tree");
      chunks_[i].level = levels[i];
      std::ranges::sort(runs[i]);
      for (const auto& [offset, count] : runs[i]) {
        if (offset != chunks_[i].count || offset + count > kMostGaussians) {
          Fail("has a tree whose parts of " + chunks_[i].name + " overlap or leave a gap");
        }
        chunks_[i].count += count;
      }
    }
  }

  // Older files do not have these counts.
  void CheckCounts(const Json& meta) const {
    std::vector<uint64_t> found(static_cast<size_t>(levels_));
    uint64_t all = 0;
    for (const Chunk& chunk : chunks_) {
      found[static_cast<size_t>(chunk.level)] += chunk.count;
      all += chunk.count;
    }
    const Json* const count = Member(meta, "count");
    const Json* const counts = Member(meta, "counts");
    if ((count && *count != all) || (counts && *counts != found)) {
      Fail("has counts that its tree does not add up to");
    }
  }

  fs::path path_;
  int levels_ = 0;
  std::vector<Chunk> chunks_;
};

// SH of a higher degree: [count, width], new coefficients are 0.
FloatArray OfDegree(const FloatArray& sh, size_t count, size_t width) {
  FloatArray wide(count * width, 0.0F);
  const size_t narrow = sh.size() / count;
  for (size_t g = 0; g < count; ++g) {
    std::copy_n(&sh[g * narrow], std::min(narrow, width), &wide[g * width]);
  }
  return wide;
}

size_t Width(const GaussianModel& model) { return 3 * static_cast<size_t>(model.NumShCoeffs()); }

bool IsIn(const Chunk& chunk, int level) {
  return chunk.level == level || chunk.level == kEnvironment;
}

GaussianModel ReadLevel(const Index& index, int level, Monitor& monitor, BadRows bad) {
  std::vector<GaussianModel> parts;
  size_t count = 0, done = 0;
  int degree = 0;
  for (const Chunk& chunk : index.chunks()) {
    Monitor reading([&](const Progress& progress) {
      monitor.Step("load", static_cast<double>(done) + progress.fraction,
                   static_cast<double>(index.chunks().size()));
    });
    ++done;
    if (!IsIn(chunk, level)) continue;
    parts.push_back(index.ReadChunk(chunk, reading, bad));
    parts.back().source.packed = {};
    count += parts.back().NumGaussians();
    degree = std::max(degree, parts.back().sh_degree);
  }
  GaussianModel all;
  if (parts.empty()) return all;
  all.ResizeUnset(count, degree);
  all.traits = parts.front().traits;
  all.source.notes = parts.front().source.notes;
  size_t at = 0;
  for (GaussianModel& part : parts) {
    const size_t number = part.NumGaussians();
    if (part.sh_degree != degree) part.sh = OfDegree(part.sh, number, Width(all));
    const auto put = [&](const FloatArray& from, FloatArray& to) {
      const size_t width = from.size() / number;
      std::ranges::copy(from, to.begin() + static_cast<std::ptrdiff_t>(at * width));
    };
    put(part.means, all.means);
    put(part.quats_wxyz, all.quats_wxyz);
    put(part.log_scales, all.log_scales);
    put(part.opacity_logits, all.opacity_logits);
    put(part.sh, all.sh);
    at += number;
    part = {};
  }
  return all;
}

fs::path SourceOf(const GaussianModel& model) {
  return std::string(model.source.packed.begin(), model.source.packed.end());
}

Index IndexOf(const GaussianModel& model) { return Index(SourceOf(model)); }

bool IsSlice(const FloatArray& part, const FloatArray& all, size_t first) {
  return first + part.size() <= all.size() &&
         std::equal(part.begin(), part.end(), all.begin() + static_cast<std::ptrdiff_t>(first));
}

[[noreturn]] void FailOther(const fs::path& path) {
  throw OptionError(path.string() +
                    ": Retint writes a streamed SOG only with the Gaussians of the streamed SOG "
                    "that it opened. Write another format, such as .sog");
}

void Copy(const fs::path& from, const fs::path& to) {
  const InputFile file(from);
  AtomicFile copy(to);
  copy.CopyFrom(file.descriptor(), file.size(), [](uint64_t) {});
  copy.Commit();
}

class Writer {
 public:
  Writer(const Index& index, const fs::path& path, std::span<const GaussianModel> levels,
         Monitor& monitor)
      : index_(index), path_(path), levels_(levels), monitor_(monitor) {}

  // `staged`: the place to write to instead.
  void Write(const fs::path& staged) {
    folder_ = staged.parent_path();
    std::vector<size_t> at(levels_.size());  // Gaussians in the level's earlier chunks
    bool changed = false;
    // Finest first: it tells whether the other levels are needed.
    for (int level = 0; level < index_.levels(); ++level) {
      for (const Chunk& chunk : index_.chunks()) {
        const bool is_finest = level == 0 && chunk.level == kEnvironment;
        if (chunk.level != level && !is_finest) continue;
        monitor_.Step("save", static_cast<double>(done_++),
                      static_cast<double>(index_.chunks().size()));
        if (static_cast<size_t>(level) >= levels_.size()) {
          if (changed) FailLevels();
          CopyChunk(chunk);
          continue;
        }
        changed |= WriteChunk(chunk, levels_[static_cast<size_t>(level)], &at[size_t(level)]);
      }
    }
    for (size_t i = 0; i < levels_.size(); ++i) CheckCount(i, at[i]);
    Copy(index_.path(), staged);
  }

 private:
  [[noreturn]] void FailLevels() const {
    throw OptionError(path_.string() +
                      ": the other levels of detail would keep their colors. Write another format");
  }

  // The environment at the end of each level is counted only for the finest.
  void CheckCount(size_t level, size_t written) const {
    const size_t rest = level == 0 ? 0 : environment_;
    if (written + rest != levels_[level].NumGaussians()) FailOther(path_);
  }

  // Returns whether a color has changed.
  bool WriteChunk(const Chunk& chunk, const GaussianModel& level, size_t* at) {
    Monitor reading([&](const Progress&) { monitor_.ThrowIfCancelled(); });
    GaussianModel part = index_.ReadChunk(chunk, reading, BadRows::kRefuse);
    const size_t first = *at, count = part.NumGaussians(), width = Width(level);
    *at += count;
    if (chunk.level == kEnvironment) environment_ = count;
    if (!IsSlice(part.means, level.means, 3 * first) ||
        !IsSlice(part.quats_wxyz, level.quats_wxyz, 4 * first) ||
        !IsSlice(part.log_scales, level.log_scales, 3 * first) ||
        !IsSlice(part.opacity_logits, level.opacity_logits, first)) {
      FailOther(path_);
    }
    if (IsSlice(OfDegree(part.sh, count, width), level.sh, width * first)) {
      CopyChunk(chunk);
      return false;
    }
    const auto begin = level.sh.begin() + static_cast<std::ptrdiff_t>(width * first);
    part.sh.assign(begin, begin + static_cast<std::ptrdiff_t>(width * count));
    part.sh_degree = level.sh_degree;
    const fs::path from = index_.PathOf(chunk);
    WriteSogFiles(folder_ / chunk.name, RecolorSog(*SogFiles::Open(from), part, from, reading));
    return true;
  }

  void CopyChunk(const Chunk& chunk) {
    const fs::path from = index_.PathOf(chunk);
    for (const fs::path& file : SogCodec().Files(from)) {
      Copy(file, folder_ / fs::path(chunk.name).parent_path() / file.filename());
    }
  }

  const Index& index_;
  const fs::path& path_;
  std::span<const GaussianModel> levels_;
  Monitor& monitor_;
  fs::path folder_;
  size_t done_ = 0, environment_ = 0;
};

}  // namespace

std::span<const std::string_view> StreamedSogCodec::Extensions() const {
  static constexpr std::array<std::string_view, 1> extensions = {kFileName};
  return extensions;
}

bool StreamedSogCodec::Sniff(std::string_view head) const {
  return head.starts_with('{') && head.find("\"lodLevels\"") != std::string_view::npos;
}

GaussianModel StreamedSogCodec::Read(const fs::path& path, Monitor& monitor, BadRows bad) const {
  const Index index(fs::absolute(path).lexically_normal());
  GaussianModel model = ReadLevel(index, 0, monitor, bad);
  const std::string& source = index.path().native();
  model.source.packed_format = kMark;
  model.source.packed.assign(source.begin(), source.end());
  if (index.levels() > 1) {
    model.source.notes.push_back("the splat has " + std::to_string(index.levels()) +
                                 " levels of detail, and you see the finest; if you save an edit "
                                 "as lod-meta.json, it is made in all of them");
  }
  return model;
}

std::vector<fs::path> StreamedSogCodec::Files(const fs::path& path) const {
  const Index index(path);
  std::vector<fs::path> files = {path};
  for (const Chunk& chunk : index.chunks()) {
    const std::vector<fs::path> parts = SogCodec().Files(index.PathOf(chunk));
    files.insert(files.end(), parts.begin(), parts.end());
  }
  return files;
}

void CheckStreamedSog(const fs::path& path, const GaussianModel& model) {
  if (!IsStreamedSog(path)) return;
  if (!IsStreamedSog(model)) FailOther(path);
  std::error_code code;
  if (fs::equivalent(fs::absolute(path).parent_path(), SourceOf(model).parent_path(), code)) {
    throw OptionError(path.string() +
                      ": Retint does not replace the streamed SOG that it opened. Name another "
                      "folder");
  }
}

void StreamedSogCodec::Write(const fs::path& path, const GaussianModel& model,
                             Monitor& monitor) const {
  WriteStreamedSog(path, std::span(&model, 1), monitor);
}

bool IsStreamedSog(const GaussianModel& model) { return model.source.packed_format == kMark; }

bool IsStreamedSog(const fs::path& path) { return path.filename() == kFileName; }

int NumStreamedLevels(const GaussianModel& finest) { return IndexOf(finest).levels(); }

GaussianModel ReadStreamedLevel(const GaussianModel& finest, int level, Monitor& monitor) {
  return ReadLevel(IndexOf(finest), level, monitor, BadRows::kRefuse);
}

void WriteStreamedSog(const fs::path& path, std::span<const GaussianModel> levels,
                      Monitor& monitor) {
  if (levels.empty()) FailOther(path);
  CheckStreamedSog(path, levels.front());
  const Index index = IndexOf(levels.front());
  StagedOutput staged;
  staged.Add(path, [&](const fs::path& to) { Writer(index, path, levels, monitor).Write(to); });
  staged.Commit();
  monitor.Step("save", 1, 1);
}

}  // namespace retint
