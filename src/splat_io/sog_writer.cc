// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/sog_writer.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "splat_io/sog_files.h"
#include "splat_io/sog_tables.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMark = "SOG 2";  // of SourceLayout::packed_format
constexpr int kMostSide = 16383;        // of a side of a WebP picture, in pixels
// The largest distance of a new color from its entry in existing tables: 1 of 255 steps of the
// color, or as much of a higher coefficient. Farther off, tables are made anew.
constexpr float kMostOff = 1 / 255.0f / kShC0;

// Opaque black.
void Clear(RgbaPicture& picture) {
  for (size_t i = 0; i < picture.rgba.size(); ++i) picture.rgba[i] = i % 4 == 3 ? 255 : 0;
}

// A picture with one pixel a Gaussian; remaining pixels are opaque black.
RgbaPicture PictureFor(size_t count, const std::filesystem::path& path) {
  const auto n = static_cast<double>(count);
  const int width = 4 * static_cast<int>(std::ceil(std::sqrt(n) / 4));
  const int height = 4 * static_cast<int>(std::ceil(n / width / 4));
  if (width > kMostSide || height > kMostSide) {
    throw RunError(path.string() + ": not written: too many Gaussians for a SOG scene");
  }
  RgbaPicture picture{width, height, {}};
  picture.rgba.resize(size_t(width) * size_t(height) * 4);
  Clear(picture);
  return picture;
}

std::vector<float> Padded(std::vector<float> table) {
  table.resize(kTableSize, table.back());
  return table;
}

class Encoder {
 public:
  Encoder(const GaussianModel& model, std::span<const uint32_t> order,
          const std::filesystem::path& path, Monitor& monitor)
      : model_(model),
        order_(order),
        path_(path),
        monitor_(monitor),
        known_(SogTables::Of(model)),
        count_(model.NumGaussians()) {}

  // The files `files`, with the colors of the model.
  std::map<std::string, std::string> Recolor(const SogFiles& files) {
    meta_ = Json::parse(files.Read("meta.json"));
    const bool has_bands = meta_.contains("shN") && meta_["shN"]["bands"] != 0;
    const auto name_of = [&](const char* part, size_t index) {
      return meta_[part]["files"][index].get<std::string>();
    };
    for (const char* part : {"means", "quats", "scales"}) {
      for (size_t i = 0; i < (part == std::string_view("means") ? 2 : 1); ++i) {
        files_[name_of(part, i)] = files.Read(name_of(part, i));
      }
    }
    const auto picture_of = [&](const std::string& name) {
      return DecodeWebp(files.Read(name), count_, 4 * uint64_t{count_} + 65536, path_, name);
    };
    // Viewers read all values of a Gaussian in one pixel: pictures keep their size.
    const std::string colors = name_of("sh0", 0);
    RgbaPicture picture = picture_of(colors), labels = picture;
    std::string centroids_name = "shN_centroids.webp", labels_name = "shN_labels.webp";
    if (has_bands) {
      centroids_name = name_of("shN", 0);
      labels_name = name_of("shN", 1);
      labels = picture_of(labels_name);
    } else {
      Clear(labels);
    }
    meta_["sh0"]["files"] = Json::array();
    AddColors(std::move(picture), colors);
    if (model_.sh_degree > 0) {
      meta_["shN"]["files"] = Json::array();
      AddBands(std::move(labels), centroids_name, labels_name);
    }
    files_["meta.json"] = meta_.dump() + "\n";
    return std::move(files_);
  }

  std::map<std::string, std::string> Encode() {
    meta_["version"] = 2;
    meta_["asset"] = {{"generator", "Retint"}};
    meta_["count"] = count_;
    meta_["antialias"] = false;
    AddMeans();
    AddScales();
    AddRotations();
    AddColors(PictureFor(count_, path_), "sh0.webp");
    if (model_.sh_degree > 0) {
      AddBands(PictureFor(count_, path_), "shN_centroids.webp", "shN_labels.webp");
    }
    if (model_.traits.render_model == RenderModel::kMip) {
      meta_["model"] = "antialiased";
      meta_["antialias"] = true;
    } else if (model_.traits.render_model == RenderModel::k2dgs) {
      meta_["model"] = "2dgs";
    }
    files_["meta.json"] = meta_.dump() + "\n";
    return std::move(files_);
  }

 private:
  void Add(const char* part, const std::string& name, const RgbaPicture& picture) {
    monitor_.Step("save", 0.1 * static_cast<double>(files_.size()), 1);
    files_[name] = EncodeWebp(picture);
    meta_[part]["files"].push_back(name);
  }

  static double ToLog(float x) { return std::copysign(std::log1p(std::abs(double{x})), x); }

  // Whether the source's bounds along an axis still fit: they contain all values, and little more.
  bool KnownBoundsServe(double low, double high, size_t axis) const {
    if (known_.bounds.empty()) return false;
    const double least = double{known_.bounds[axis]}, most = double{known_.bounds[3 + axis]};
    const double slack = 1e-6 * (1 + std::max(std::abs(least), std::abs(most)));  // of floats
    return low >= least - slack && high <= most + slack && high - low >= 0.9 * (most - least);
  }

  void AddMeans() {
    std::array<float, 3> least, most;
    for (size_t i = 0; i < 3; ++i) {
      double low = INFINITY, high = -INFINITY;
      for (size_t g = 0; g < count_; ++g) {
        const double value = ToLog(model_.means[3 * g + i]);
        low = std::min(low, value);
        high = std::max(high, value);
      }
      const bool known = KnownBoundsServe(low, high, i);
      least[i] = known ? known_.bounds[i] : static_cast<float>(low);
      most[i] = known ? known_.bounds[3 + i] : static_cast<float>(high);
    }
    RgbaPicture lower = PictureFor(count_, path_), upper = lower;
    for (size_t at = 0; at < count_; ++at) {
      for (size_t i = 0; i < 3; ++i) {
        const double span = double{most[i]} - double{least[i]};
        const double t = ToLog(model_.means[3 * order_[at] + i]) - double{least[i]};
        const uint32_t step = span > 0 ? RoundTo(65535 * t / span, 65535) : 0;
        lower.rgba[4 * at + i] = static_cast<uint8_t>(step & 255);
        upper.rgba[4 * at + i] = static_cast<uint8_t>(step >> 8);
      }
    }
    meta_["means"]["mins"] = least;
    meta_["means"]["maxs"] = most;
    Add("means", "means_l.webp", lower);
    Add("means", "means_u.webp", upper);
  }

  void AddScales() {
    const std::vector<float> table =
        Padded(FitTable({model_.log_scales.begin(), model_.log_scales.end()}));
    const TableLookup lookup(table);
    RgbaPicture picture = PictureFor(count_, path_);
    for (size_t at = 0; at < count_; ++at) {
      for (size_t i = 0; i < 3; ++i) {
        picture.rgba[4 * at + i] = lookup.Find(model_.log_scales[3 * order_[at] + i]);
      }
    }
    meta_["scales"]["codebook"] = table;
    Add("scales", "scales.webp", picture);
  }

  void AddRotations() {
    RgbaPicture picture = PictureFor(count_, path_);
    for (size_t at = 0; at < count_; ++at) {
      const size_t g = order_[at];
      std::array<float, 4> quat;
      std::copy_n(&model_.quats_wxyz[4 * g], 4, quat.begin());
      // If rounding changes which component is largest, the packed quaternion would change.
      if (known_.quats.size() == 4 * count_ && DecodeSogQuat(&known_.quats[4 * g]) == quat) {
        std::copy_n(&known_.quats[4 * g], 4, &picture.rgba[4 * at]);
        continue;
      }
      const SmallestThree packed = PackSmallestThree(Normalized(quat));
      for (size_t i = 0; i < 3; ++i) {
        const double unit = packed.rest[i] / std::sqrt(0.5);
        picture.rgba[4 * at + i] = static_cast<uint8_t>(RoundTo((unit + 1) / 2 * 255, 255));
      }
      picture.rgba[4 * at + 3] = static_cast<uint8_t>(252 + packed.largest);
    }
    Add("quats", "quats.webp", picture);
  }

  void AddColors(RgbaPicture picture, const std::string& name) {
    const size_t width = static_cast<size_t>(model_.NumShCoeffs()) * 3;
    std::vector<float> values;
    values.reserve(3 * count_);
    for (size_t g = 0; g < count_; ++g) {
      const float* sh = &model_.sh[g * width];
      values.insert(values.end(), sh, sh + 3);
    }
    const std::vector<float> table = Padded(
        known_.colors.empty() ? FitTable(values) : RefitTable(known_.colors, values, kMostOff));
    const TableLookup lookup(table);
    for (size_t at = 0; at < count_; ++at) {
      for (size_t i = 0; i < 3; ++i) {
        picture.rgba[4 * at + i] = lookup.Find(values[3 * order_[at] + i]);
      }
      picture.rgba[4 * at + 3] =
          static_cast<uint8_t>(RoundTo(255 * Sigmoid(model_.opacity_logits[order_[at]]), 255));
    }
    meta_["sh0"]["codebook"] = table;
    Add("sh0", name, picture);
  }

  void AddBands(RgbaPicture labels, const std::string& centroids_name,
                const std::string& labels_name) {
    const auto coefficients = static_cast<size_t>(model_.NumShCoeffs()) - 1;
    const size_t width = 3 * coefficients;
    const VectorPalette palette =
        FitPalette(model_.sh.data() + 3, count_, width, width + 3,
                   known_.palette.size() % width == 0 ? KnownPalette() : std::vector<float>(),
                   kSogMostPalette, monitor_);
    const std::vector<float> table =
        Padded(known_.bands.empty() ? FitTable(palette.entries)
                                    : RefitTable(known_.bands, palette.entries, kMostOff));
    const TableLookup lookup(table);
    const size_t rows = (palette.Count() + kSogPaletteColumns - 1) / kSogPaletteColumns;
    RgbaPicture centroids{
        static_cast<int>(kSogPaletteColumns * coefficients), static_cast<int>(rows), {}};
    centroids.rgba.assign(size_t(centroids.width) * rows * 4, 255);
    // A row of the picture holds 64 sets, so consecutive sets are consecutive pixels.
    for (size_t i = 0; i < palette.entries.size(); ++i) {
      centroids.rgba[i / 3 * 4 + i % 3] = lookup.Find(palette.entries[i]);
    }
    for (size_t at = 0; at < count_; ++at) {
      const uint32_t label = palette.labels[order_[at]];
      labels.rgba[4 * at] = static_cast<uint8_t>(label & 255);
      labels.rgba[4 * at + 1] = static_cast<uint8_t>(label >> 8);
    }
    meta_["shN"]["count"] = palette.Count();
    meta_["shN"]["bands"] = model_.sh_degree;
    meta_["shN"]["codebook"] = table;
    Add("shN", centroids_name, centroids);
    Add("shN", labels_name, labels);
  }

  std::vector<float> KnownPalette() const {
    std::vector<float> values;
    values.reserve(known_.palette.size());
    for (const uint8_t entry : known_.palette) values.push_back(known_.bands[entry]);
    return values;
  }

  const GaussianModel& model_;
  std::span<const uint32_t> order_;
  const std::filesystem::path& path_;
  Monitor& monitor_;
  SogTables known_;
  size_t count_;
  Json meta_;
  std::map<std::string, std::string> files_;
};

}  // namespace

// Stores the lengths first, which separate the parts.
void SogTables::Keep(SourceLayout& source) const {
  source.packed_format = kMark;
  source.packed.clear();
  source.packed.reserve(5 * sizeof(uint64_t) +
                        sizeof(float) * (bounds.size() + colors.size() + bands.size()) +
                        palette.size() + quats.size());
  const auto append = [&](const auto& values) {
    const auto* bytes = reinterpret_cast<const char*>(values.data());
    source.packed.insert(source.packed.end(), bytes, bytes + values.size() * sizeof(values[0]));
  };
  append(std::array<uint64_t, 5>{bounds.size(), colors.size(), bands.size(), palette.size(),
                                 quats.size()});
  for (const auto* table : {&bounds, &colors, &bands}) append(*table);
  append(palette);
  append(quats);
}

SogTables SogTables::Of(const GaussianModel& model) {
  SogTables tables;
  std::array<uint64_t, 5> sizes;
  const UnsetVector<char>& packed = model.source.packed;
  if (model.source.packed_format != kMark || packed.size() < sizeof(sizes)) return tables;
  std::memcpy(sizes.data(), packed.data(), sizeof(sizes));
  const char* next = packed.data() + sizeof(sizes);
  const auto take = [&](auto& values, uint64_t count) {
    values.resize(count);
    const size_t bytes = count * sizeof(values[0]);
    std::copy_n(next, bytes, reinterpret_cast<char*>(values.data()));
    next += bytes;
  };
  take(tables.bounds, sizes[0]);
  take(tables.colors, sizes[1]);
  take(tables.bands, sizes[2]);
  take(tables.palette, sizes[3]);
  take(tables.quats, sizes[4]);
  return tables;
}

std::array<float, 4> DecodeSogQuat(const uint8_t* rgba) {
  SmallestThree packed;
  packed.largest = rgba[3] - 252;
  for (size_t i = 0; i < 3; ++i) packed.rest[i] = (rgba[i] / 255.0 * 2 - 1) * std::sqrt(0.5);
  const std::array<double, 4> unit = UnpackSmallestThree(packed);
  std::array<float, 4> quat;
  for (size_t i = 0; i < 4; ++i) quat[i] = static_cast<float>(unit[i]);
  return quat;
}

std::map<std::string, std::string> EncodeSog(const GaussianModel& model,
                                             std::span<const uint32_t> order,
                                             const std::filesystem::path& path, Monitor& monitor) {
  return Encoder(model, order, path, monitor).Encode();
}

std::map<std::string, std::string> RecolorSog(const SogFiles& files, const GaussianModel& model,
                                              const std::filesystem::path& path, Monitor& monitor) {
  std::vector<uint32_t> order(model.NumGaussians());
  std::iota(order.begin(), order.end(), 0u);
  return Encoder(model, order, path, monitor).Recolor(files);
}

}  // namespace retint
