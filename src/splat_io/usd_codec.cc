// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usd_codec.h"

#include <algorithm>
#include <array>
#include <optional>

#include "base/files.h"
#include "splat_io/splat_row.h"
#include "splat_io/splat_tags.h"
#include "splat_io/usd_package.h"
#include "splat_io/usd_splats.h"
#include "splat_io/usda_reader.h"
#include "splat_io/usda_writer.h"
#include "splat_io/usdc_reader.h"
#include "splat_io/usdc_writer.h"

namespace retint {
namespace {

// Values of SourceLayout::packed_format, which are also the extensions.
constexpr std::string_view kText = ".usda", kCrate = ".usdc", kPackage = ".usdz",
                           kEither = ".usd";  // text or a crate; a new one is a crate
constexpr std::string_view kTextMark = "#usda ";

std::string_view KindOf(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.starts_with(kTextMark)) return kText;
  if (bytes.starts_with(kCrateMark)) return kCrate;
  if (IsUsdPackage(bytes)) return kPackage;
  throw InputError(path,
                   "is not an OpenUSD stage: neither text, a crate nor a package, or damaged");
}

std::string LowerExtension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

UsdStage ReadLayer(std::string_view layer, const std::filesystem::path& path) {
  if (layer.starts_with(kTextMark)) return ReadUsda(layer, path);
  if (layer.starts_with(kCrateMark)) return ReadUsdc(layer, path);
  throw InputError(path, "its layer is neither OpenUSD text nor a crate, or damaged");
}

// The stage's own layer in `bytes`, a whole file.
std::string_view LayerOf(std::string_view bytes, const std::filesystem::path& path) {
  return KindOf(bytes, path) == kPackage ? ReadUsdPackage(bytes, path)[0].bytes : bytes;
}

// The file that the model came from, with the changed values. nullopt if its layer cannot hold
// them.
std::optional<std::string> EditedLayer(const GaussianModel& model,
                                       const std::filesystem::path& path, Monitor& monitor) {
  const std::string_view file(model.source.packed.data(), model.source.packed.size());
  std::string layer(LayerOf(file, path));
  const UsdStage stage = ReadLayer(layer, path);
  const UsdSplats splats(stage, path);
  const GaussianModel was = splats.Load(monitor);
  if (!EditUsdLayer(splats, was, model, path, layer)) return std::nullopt;
  return layer;
}

void WritePackage(const std::filesystem::path& path, AtomicFile& file,
                  const std::function<void(const UsdPackageWriter::Write&)>& layer,
                  std::string_view source) {
  UsdPackageWriter package(file, path);
  if (source.empty()) {
    package.Add("scene.usdc", layer);
  } else {
    const std::vector<UsdPackageFile> files = ReadUsdPackage(source, path);
    package.Add(files[0].name, layer);
    for (size_t i = 1; i < files.size(); ++i) {
      package.Add(files[i].name,
                  [&](const UsdPackageWriter::Write& write) { write(files[i].bytes); });
    }
  }
  package.Finish();
}

}  // namespace

std::span<const std::string_view> UsdCodec::Extensions() const {
  static constexpr std::array<std::string_view, 4> extensions = {kText, kCrate, kPackage, kEither};
  return extensions;
}

bool UsdCodec::Sniff(std::string_view head) const {
  return head.starts_with(kTextMark) || head.starts_with(kCrateMark) || IsUsdPackage(head);
}

GaussianModel UsdCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                             BadRows bad) const {
  monitor.Step("load", 0, 1);
  const std::string bytes = ReadFile(path);
  const std::string_view kind = KindOf(bytes, path);
  GaussianModel model;
  {
    const UsdStage stage = ReadLayer(LayerOf(bytes, path), path);
    model = UsdSplats(stage, path).Load(monitor);
  }
  ValidateRead(model, path, bad);
  model.source.packed_format = kind;
  model.source.packed.assign(bytes.begin(), bytes.end());
  return model;
}

void UsdCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                     Monitor& monitor) const {
  ValidateWrite(model, path);
  const std::string kind = LowerExtension(path), &source_kind = model.source.packed_format;
  std::optional<std::string> edited;
  const bool same =
      source_kind == kind || (kind == kEither && (source_kind == kText || source_kind == kCrate));
  if (same) edited = EditedLayer(model, path, monitor);
  const auto layer = [&](const UsdPackageWriter::Write& write) {
    if (edited) return write(*edited);
    kind == kText ? WriteUsda(model, monitor, write) : WriteUsdc(model, monitor, write);
  };
  AtomicFile file(path);
  if (kind == kPackage) {
    const std::string_view source(model.source.packed.data(), model.source.packed.size());
    WritePackage(path, file, layer, edited ? source : std::string_view());
  } else {
    layer([&](std::string_view bytes) { file.Write(bytes); });
  }
  file.Commit();
}

std::vector<std::string> UsdCodec::Losses(const GaussianModel& model) const {
  return CommonLosses(model, 3, Name(), {}, kAllColorSpaces);
}

}  // namespace retint
