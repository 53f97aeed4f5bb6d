// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/sog_codec.h"

#include <array>
#include <atomic>
#include <exception>
#include <numeric>

#include "scene/morton.h"
#include "splat_io/compression.h"
#include "splat_io/json.h"
#include "splat_io/parallel_rows.h"
#include "splat_io/sog_files.h"
#include "splat_io/sog_writer.h"
#include "splat_io/splat_row.h"
#include "splat_io/splat_tags.h"

namespace retint {
namespace {

using Json = nlohmann::json;

constexpr uint64_t kPixelBytes = 5 * 4;  // of the five pictures, per Gaussian

// The inputs of decoding steps. Each bit is a picture, or the memory for the values.
enum Input : uint32_t {
  kMemory = 1,
  kMeansLow = 2,
  kMeansHigh = 4,
  kQuats = 8,
  kScales = 16,
  kColors = 32,
  kCentroids = 64,
  kLabels = 128
};

struct Bands {
  size_t palette = 0, coefficients = 0;  // of each set; 0 at degree 0
  std::vector<float> codebook;
  RgbaPicture centroids, labels;
};

// The parsed meta.json and its pictures.
class Scene {
 public:
  Scene(const std::filesystem::path& path, Monitor& monitor) : path_(path), monitor_(monitor) {
    files_ = SogFiles::Open(path);
    const std::string text = files_->Read("meta.json");
    meta_ = ParseJson(text, path_, "meta.json");
    if (!meta_.contains("version")) {
      Fail("is of SOG version 1, which is not supported; supported: 2");
    }
    if (const Json& version = meta_["version"]; version != 2) {
      Fail("is of SOG version " + (version.is_number() ? version.dump() : "?") +
           ", which is not supported; supported: 2");
    }
    count_ = Whole(meta_, "count", (MostUnpacked(files_->PackedBytes()) / kPixelBytes));
    if (count_ == 0) throw InputError(path_, "holds no Gaussians");
    const Json& means = Part("means");
    least_ = Numbers(means, "mins", 3);
    most_ = Numbers(means, "maxs", 3);
    scale_table_ = Numbers(Part("scales"), "codebook", 256);
    color_table_ = Numbers(Part("sh0"), "codebook", 256);
    Want(means, 0, kMeansLow, means_low_);
    Want(means, 1, kMeansHigh, means_high_);
    Want(Part("quats"), 0, kQuats, quats_);
    Want(Part("scales"), 0, kScales, scales_);
    Want(Part("sh0"), 0, kColors, colors_);
    if (meta_.contains("shN")) WantBands(Part("shN"));
  }

  std::vector<std::filesystem::path> Files() const {
    std::vector<std::string> names = {"meta.json"};
    for (const Wanted& one : wanted_) names.push_back(one.name);
    return files_->Paths(names);
  }

  // Reads packed files one after the other, then decodes all in parallel, the largest first.
  // Meanwhile, the system provides memory pages for the Gaussians. Values are decoded as soon as
  // their pictures are complete.
  GaussianModel Read() && {
    std::vector<std::string> packed;
    for (const Wanted& one : wanted_) {
      monitor_.Step("load", 0.1, 1);
      packed.push_back(files_->Read(one.name));
    }
    std::vector<size_t> order = LargestFirst(packed);
    order.insert(order.begin() + 1, wanted_.size());
    if (bands_.coefficients == 0) Arrive(kCentroids);  // there are none
    std::atomic<size_t> tasks = 0;
    ForEachTask(order, [&](size_t i) {
      monitor_.Step("load", 1.0 + static_cast<double>(tasks++), 1.0 + double(order.size()));
      if (i == wanted_.size()) {
        model_.Resize(count_, degree_);
        return Arrive(kMemory);
      }
      const Wanted& one = wanted_[i];
      *one.picture = DecodeWebp(packed[i], one.least_pixels, one.most_pixels, path_, one.name);
      if (one.input == kCentroids) CheckWidth(one);
      Arrive(one.input);
    });
    for (const Step& step : steps_) {
      if (step.fault) std::rethrow_exception(step.fault);
    }
    TakeRenderModel();
    monitor_.Step("load", 1, 1);
    return std::move(model_);
  }

 private:
  [[noreturn]] void Fail(const std::string& fault) const {
    throw InputError(path_, "meta.json " + fault);
  }

  const Json& Part(const char* name) const {
    const auto found = meta_.find(name);
    if (found == meta_.end() || !found->is_object()) Fail("lacks " + std::string(name));
    return *found;
  }

  size_t Whole(const Json& object, const char* name, uint64_t most) const {
    const auto found = object.find(name);
    if (found == object.end() || !found->is_number_unsigned() || found->get<uint64_t>() > most) {
      Fail(std::string("has no ") + name + " from 0 to " + std::to_string(most) +
           ", the most that its pictures can hold");
    }
    return found->get<uint64_t>();
  }

  std::vector<float> Numbers(const Json& object, const char* name, size_t count) const {
    const auto found = object.find(name);
    std::vector<float> numbers;
    if (found != object.end() && found->is_array()) {
      for (const Json& value : *found) {
        if (value.is_number()) numbers.push_back(value.get<float>());
      }
      if (found->size() != numbers.size()) numbers.clear();
    }
    if (numbers.size() != count) {
      Fail(std::string("has no list of ") + std::to_string(count) + " numbers where " + name +
           " is expected");
    }
    return numbers;
  }

  std::string FileName(const Json& object, size_t index) const {
    const auto found = object.find("files");
    if (found == object.end() || !found->is_array() || found->size() <= index ||
        !(*found)[index].is_string()) {
      Fail("does not name its pictures");
    }
    const auto name = (*found)[index].get<std::string>();
    // Only files in the bundle or the folder.
    if (name.empty() || name.find_first_of("/\\") != std::string::npos || name[0] == '.') {
      Fail("names a picture that is no plain file name");
    }
    return name;
  }

  // A picture to decode, and its limits on pixels.
  struct Wanted {
    std::string name;
    uint64_t least_pixels, most_pixels;
    Input input;
    RgbaPicture* picture;
  };

  void Want(const Json& object, size_t index, Input input, RgbaPicture& picture) {
    wanted_.push_back(
        {FileName(object, index), count_, 4 * uint64_t{count_} + 65536, input, &picture});
  }

  void CheckWidth(const Wanted& centroids) const {
    const uint64_t width = kSogPaletteColumns * bands_.coefficients;
    if (uint64_t(bands_.centroids.width) == width) return;
    throw InputError(
        path_, centroids.name + " has not the width of its palette, " + std::to_string(width));
  }

  void WantBands(const Json& part) {
    degree_ = static_cast<int>(Whole(part, "bands", 3));
    if (degree_ == 0) return;
    bands_.coefficients = static_cast<size_t>((degree_ + 1) * (degree_ + 1) - 1);
    bands_.palette = Whole(part, "count", kSogMostPalette);
    bands_.codebook = Numbers(part, "codebook", 256);
    const uint64_t width = kSogPaletteColumns * bands_.coefficients;
    const uint64_t height = (bands_.palette + kSogPaletteColumns - 1) / kSogPaletteColumns;
    wanted_.push_back({FileName(part, 0), width * height,
                       width * (kSogMostPalette / kSogPaletteColumns), kCentroids,
                       &bands_.centroids});
    Want(part, 1, kLabels, bands_.labels);
  }

  // A step that runs once all its inputs are complete.
  struct Step {
    void (Scene::*work)();
    std::atomic<uint32_t> missing;  // of Input
    std::exception_ptr fault;
  };

  // Runs the steps for which `input` was the last missing one.
  void Arrive(Input input) {
    for (Step& step : steps_) {
      if (step.missing.fetch_and(~uint32_t{input}) != input) continue;
      try {
        (this->*step.work)();
      } catch (...) {
        step.fault = std::current_exception();
      }
    }
  }

  // PlayCanvas writes "model" since 2026, and "antialias" before.
  void TakeRenderModel() {
    SplatTraits& traits = model_.traits;
    const Json& model = meta_.contains("model") ? meta_["model"] : Json();
    const bool is_flagged = meta_.contains("antialias") && meta_["antialias"] == true;
    if (model == "antialiased" || (is_flagged && !model.is_string())) {
      traits.render_model = RenderModel::kMip;
    } else if (model == "2dgs") {
      traits.render_model = RenderModel::k2dgs;
    } else if (model.is_string() && model != "default") {
      model_.source.notes.push_back("meta.json names a model that is not known, " +
                                    model.dump().substr(0, 80) + ": rendered as default");
    }
    if (traits.render_model != RenderModel::kDefault) {
      traits.render_model_reason =
          "meta.json's \"" + std::string(is_flagged ? "antialias" : "model") + "\"";
    }
    NoteRenderModel(model_);
  }

  void KeepTables() {
    SogTables tables{least_, color_table_, bands_.codebook, {}, {}};
    tables.quats.assign(quats_.rgba.begin(),
                        quats_.rgba.begin() + static_cast<std::ptrdiff_t>(4 * count_));
    tables.bounds.insert(tables.bounds.end(), most_.begin(), most_.end());
    tables.palette.resize(3 * bands_.coefficients * bands_.palette);
    for (size_t i = 0; i < bands_.coefficients * bands_.palette; ++i) {
      std::copy_n(&bands_.centroids.rgba[4 * i], 3, &tables.palette[3 * i]);
    }
    tables.Keep(model_.source);
  }

  // Calls body(g) for every Gaussian, in parallel.
  template <typename Body>
  void ForGaussians(const Body& body) {
    constexpr size_t kRows = 4096;
    ForRows(
        count_, [&](size_t) { monitor_.ThrowIfCancelled(); },
        [&](size_t begin, size_t end) {
          for (size_t g = begin; g < end; ++g) body(g);
        },
        kRows);
  }

  static float FromLog(double value) {
    return static_cast<float>(std::copysign(std::expm1(std::abs(value)), value));
  }

  void DecodeMeans() {
    ForGaussians([&](size_t g) {
      const uint8_t* low = &means_low_.rgba[4 * g];
      const uint8_t* high = &means_high_.rgba[4 * g];
      for (size_t i = 0; i < 3; ++i) {
        const double t = (low[i] | high[i] << 8) / 65535.0;
        model_.means[3 * g + i] = FromLog(least_[i] + (double{most_[i]} - least_[i]) * t);
      }
    });
  }

  void DecodeQuats() {
    ForGaussians([&](size_t g) {
      const uint8_t* quat = &quats_.rgba[4 * g];
      if (quat[3] < 252) {
        throw InputError(path_, "Gaussian " + std::to_string(g) + ": rotation is marked " +
                                    std::to_string(quat[3]) + ", expected 252 to 255");
      }
      const std::array<float, 4> quat_wxyz = DecodeSogQuat(quat);
      std::copy_n(quat_wxyz.begin(), 4, &model_.quats_wxyz[4 * g]);
    });
  }

  void DecodeScales() {
    ForGaussians([&](size_t g) {
      for (size_t i = 0; i < 3; ++i) {
        model_.log_scales[3 * g + i] = scale_table_[scales_.rgba[4 * g + i]];
      }
    });
  }

  void DecodeColors() {
    const size_t width = ShWidth();
    ForGaussians([&](size_t g) {
      const uint8_t* color = &colors_.rgba[4 * g];
      for (size_t c = 0; c < 3; ++c) model_.sh[width * g + c] = color_table_[color[c]];
      model_.opacity_logits[g] = LogitOfByte(color[3]);
    });
  }

  void DecodeBands() {
    const size_t width = ShWidth(), coefficients = bands_.coefficients;
    const auto picture_width = static_cast<size_t>(bands_.centroids.width);
    const float* codebook = bands_.codebook.data();
    ForGaussians([&, codebook, coefficients](size_t g) {
      const uint8_t* pixel = &bands_.labels.rgba[4 * g];
      const size_t label = pixel[0] | size_t{pixel[1]} << 8;
      if (label >= bands_.palette) {
        throw InputError(path_, "Gaussian " + std::to_string(g) + ": spherical harmonics are set " +
                                    std::to_string(label) + " of " +
                                    std::to_string(bands_.palette));
      }
      const size_t at =
          label / kSogPaletteColumns * picture_width + label % kSogPaletteColumns * coefficients;
      const uint8_t* set = &bands_.centroids.rgba[4 * at];
      float* to = &model_.sh[width * g + 3];
      for (size_t k = 0; k < coefficients; ++k, set += 4, to += 3) {
        to[0] = codebook[set[0]];
        to[1] = codebook[set[1]];
        to[2] = codebook[set[2]];
      }
    });
  }

  size_t ShWidth() const { return 3 * static_cast<size_t>(model_.NumShCoeffs()); }

  std::filesystem::path path_;
  Monitor& monitor_;
  std::unique_ptr<SogFiles> files_;
  std::vector<Wanted> wanted_;
  Json meta_;
  size_t count_ = 0;
  int degree_ = 0;
  GaussianModel model_;
  std::vector<float> least_, most_, scale_table_, color_table_;
  RgbaPicture means_low_, means_high_, quats_, scales_, colors_;
  Bands bands_;
  // If several steps fail, the first of these is thrown.
  std::array<Step, 6> steps_{{
      {&Scene::DecodeMeans, kMemory | kMeansLow | kMeansHigh, {}},
      {&Scene::DecodeQuats, kMemory | kQuats, {}},
      {&Scene::DecodeScales, kMemory | kScales, {}},
      {&Scene::DecodeColors, kMemory | kColors, {}},
      {&Scene::KeepTables, kQuats | kCentroids, {}},
      {&Scene::DecodeBands, kMemory | kCentroids | kLabels, {}},
  }};
};

}  // namespace

std::span<const std::string_view> SogCodec::Extensions() const {
  static constexpr std::array<std::string_view, 2> extensions = {".sog", "meta.json"};
  return extensions;
}

bool SogCodec::Sniff(std::string_view head) const {
  if (head.starts_with("PK\x03\x04") && head.size() > 30) {
    // The name of the first entry follows its header of 30 bytes.
    const std::string_view name = head.substr(30, LoadAs<uint16_t>(head.data() + 26));
    return name == "meta.json" || name.ends_with(".webp");
  }
  return head.starts_with('{') && head.find("\"means\"") != std::string_view::npos;
}

GaussianModel SogCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                             BadRows bad) const {
  monitor.Step("load", 0, 1);
  GaussianModel model = Scene(path, monitor).Read();
  ValidateRead(model, path, bad);
  return model;
}

std::vector<std::filesystem::path> SogCodec::Files(const std::filesystem::path& path) const {
  Monitor monitor;
  return Scene(path, monitor).Files();
}

void SogCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                     Monitor& monitor) const {
  ValidateWrite(model, path);
  monitor.Step("save", 0, 1);
  std::vector<uint32_t> order = WriteOrder(model);
  if (order.empty()) {
    order.resize(model.NumGaussians());
    std::iota(order.begin(), order.end(), 0u);
  }
  WriteSogFiles(path, EncodeSog(model, order, path, monitor));
  monitor.Step("save", 1, 1);
}

std::vector<std::string> SogCodec::Losses(const GaussianModel& model) const {
  return CommonLosses(model, 3, Name(), std::array{RenderModel::kMip, RenderModel::k2dgs});
}

std::vector<uint32_t> SogCodec::WriteOrder(const GaussianModel& model) const {
  if (!SogTables::Of(model).colors.empty()) return {};
  return MortonOrder(model.means);
}

}  // namespace retint
