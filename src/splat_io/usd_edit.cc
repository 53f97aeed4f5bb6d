// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstring>

#include "splat_io/axes.h"
#include "splat_io/usd_splats.h"
#include "splat_io/usda_reader.h"
#include "splat_io/usda_writer.h"

namespace retint {
namespace {

// The values of one Gaussian in an array of `model`.
std::span<const float> ValuesOf(UsdArray array, const GaussianModel& model, size_t g) {
  const size_t width = 3 * static_cast<size_t>(model.NumShCoeffs());
  const auto row = [&](const FloatArray& values, size_t n) {
    return std::span(values).subspan(g * n, n);
  };
  switch (array) {
    case UsdArray::kMeans:
      return row(model.means, 3);
    case UsdArray::kQuats:
      return row(model.quats_wxyz, 4);
    case UsdArray::kScales:
      return row(model.log_scales, 3);
    case UsdArray::kOpacities:
      return row(model.opacity_logits, 1);
    default:
      return row(model.sh, width);
  }
}

bool Same(std::span<const float> a, std::span<const float> b) {
  return std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

// An array of a prim, with changed values.
class ArrayEdit {
 public:
  ArrayEdit(const UsdSplat& splat, UsdArray array, size_t first, const GaussianModel& was,
            const GaussianModel& model)
      : splat_(splat),
        array_(array),
        first_(first),
        was_(was),
        model_(model),
        prim_from_frame_(splat.frame_from_prim.Inverse()) {}

  bool Any() const {
    for (size_t g = 0; g < splat_.count; ++g) {
      if (Changed(g)) return true;
    }
    return false;
  }

  const UsdValue* values() const { return splat_.arrays[static_cast<size_t>(array_)]; }

  // Whether the layer stores the array in a way that can be changed.
  bool Possible() const {
    if (!values() || values()->storage == UsdStorage::kOther) return false;
    return array_ != UsdArray::kColors || std::min(splat_.degree, 3) == model_.sh_degree;
  }

  // The new text between the array's brackets.
  std::string Text(std::string_view elements, const std::filesystem::path& path) const {
    std::string text;
    size_t done = 0, element = 0;
    const size_t width = values()->components;
    const size_t each = values()->floats.size() / width / splat_.count;  // per Gaussian
    std::vector<float> anew;
    bool changed = false;
    ForEachUsdaElement(elements, width, path, [&](const double*, size_t begin, size_t end) {
      const size_t g = element / each, part = element % each;
      if (part == 0) {
        changed = Changed(g);
        if (changed) anew = Anew(g);
      }
      if (changed) {
        text += elements.substr(done, begin - done);
        AppendUsdaElement(std::span(anew).subspan(part * width, width), text);
        done = end;
      }
      ++element;
    });
    return text += elements.substr(done);
  }

  // Changes the values of a crate in place.
  void Overwrite(std::string& bytes) const {
    const bool halves = values()->storage == UsdStorage::kHalves;
    const size_t width = values()->floats.size() / splat_.count;
    for (size_t g = 0; g < splat_.count; ++g) {
      if (!Changed(g)) continue;
      std::vector<float> anew = Anew(g);
      if (array_ == UsdArray::kQuats) std::rotate(anew.begin(), anew.begin() + 1, anew.end());
      for (size_t i = 0; i < width; ++i) {
        const size_t at = values()->begin + (g * width + i) * (halves ? 2 : 4);
        if (halves) {
          StoreAs(&bytes[at], FloatToHalf(anew[i]));
        } else {
          StoreAs(&bytes[at], anew[i]);
        }
      }
    }
  }

 private:
  bool Changed(size_t g) const {
    return !Same(ValuesOf(array_, was_, first_ + g), ValuesOf(array_, model_, first_ + g));
  }

  // The new values in the prim's frame. Coefficients beyond the model's degree become zero.
  std::vector<float> Anew(size_t g) const {
    SplatRow row = FlipAxes(GetRow(model_, first_ + g), kRightUpBack);
    prim_from_frame_.Move(row, model_.sh_degree);
    std::vector<float> anew = UsdValues(array_, row, model_.sh_degree);
    anew.resize(values()->floats.size() / splat_.count);
    if (splat_.names[static_cast<size_t>(array_)].ends_with('h')) {
      for (float& value : anew) value = HalfToFloat(FloatToHalf(value));
    }
    return anew;
  }

  const UsdSplat& splat_;
  UsdArray array_;
  size_t first_;
  const GaussianModel &was_, &model_;
  Placement prim_from_frame_;
};

}  // namespace

bool EditUsdLayer(const UsdSplats& splats, const GaussianModel& was, const GaussianModel& model,
                  const std::filesystem::path& path, std::string& bytes) {
  if (was.NumGaussians() != model.NumGaussians() || was.sh_degree != model.sh_degree ||
      was.traits.color_space != model.traits.color_space) {
    return false;
  }
  std::vector<ArrayEdit> edits;
  size_t first = 0;
  for (const UsdSplat& splat : splats.splats()) {
    for (size_t a = 0; a < kUsdArrays; ++a) {
      ArrayEdit edit(splat, static_cast<UsdArray>(a), first, was, model);
      if (!edit.Any()) continue;
      if (!edit.Possible()) return false;
      edits.push_back(std::move(edit));
    }
    first += splat.count;
  }
  std::vector<const ArrayEdit*> order;
  for (const ArrayEdit& edit : edits) order.push_back(&edit);
  std::sort(order.begin(), order.end(), [](const ArrayEdit* a, const ArrayEdit* b) {
    return a->values()->begin > b->values()->begin;
  });
  for (const ArrayEdit* edit : order) {  // from the end, so that earlier offsets stay valid
    const UsdValue& values = *edit->values();
    if (values.storage == UsdStorage::kText) {
      const std::string_view elements =
          std::string_view(bytes).substr(values.begin, values.end - values.begin);
      bytes.replace(values.begin, values.end - values.begin, edit->Text(elements, path));
    } else {
      edit->Overwrite(bytes);
    }
  }
  return true;
}

}  // namespace retint
