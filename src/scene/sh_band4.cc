// SPDX-License-Identifier: BSD-3-Clause
#include "scene/sh_band4.h"

#include <cstring>

namespace retint {
namespace {

constexpr size_t kFirst = 16, kEnd = 25;  // coefficients

bool IsDouble(const ExtraColumn& column) { return column.bytes_per_value == 8; }

}  // namespace

// Real spherical harmonics of degree 4, orthonormal, with the Condon-Shortley phase.
void ShBand4Basis(double x, double y, double z, double* basis) {
  const double xx = x * x, yy = y * y, zz = z * z;
  basis[0] = 2.5033429417967046 * x * y * (xx - yy);
  basis[1] = -1.7701307697799304 * y * z * (3 * xx - yy);
  basis[2] = 0.9461746957575601 * x * y * (7 * zz - 1);
  basis[3] = -0.6690465435572892 * y * z * (7 * zz - 3);
  basis[4] = 0.10578554691520431 * (zz * (35 * zz - 30) + 3);
  basis[5] = -0.6690465435572892 * x * z * (7 * zz - 3);
  basis[6] = 0.47308734787878004 * (xx - yy) * (7 * zz - 1);
  basis[7] = -1.7701307697799304 * x * z * (xx - 3 * yy);
  basis[8] = 0.6258357354491761 * (xx * (xx - 3 * yy) - yy * (3 * xx - yy));
}

std::string ShBand4Columns::Name(size_t k, size_t c) {
  return "f_rest_" + std::to_string(24 * c + k - 1);
}

bool ShBand4Columns::IsName(const std::string& column) {
  for (size_t k = kFirst; k < kEnd; ++k) {
    for (size_t c = 0; c < 3; ++c) {
      if (column == Name(k, c)) return true;
    }
  }
  return false;
}

ShBand4Columns::ShBand4Columns(GaussianModel& model) {
  if (model.sh_degree != 3) return;
  for (size_t k = kFirst; k < kEnd; ++k) {
    for (size_t c = 0; c < 3; ++c) {
      ExtraColumn* found = nullptr;
      for (ExtraColumn& extra : model.source.extras) {
        const bool is_float = extra.type == "float" || extra.type == "float32" ||
                              extra.type == "double" || extra.type == "float64";
        const size_t bytes = model.NumGaussians() * static_cast<size_t>(extra.bytes_per_value);
        if (is_float && extra.bytes.size() == bytes && extra.name == Name(k, c)) found = &extra;
      }
      if (!found) {
        columns_.clear();
        return;
      }
      columns_.push_back(found);
    }
  }
}

void ShBand4Columns::AddTo(GaussianModel& model) {
  for (size_t k = kFirst; k < kEnd; ++k) {
    for (size_t c = 0; c < 3; ++c) {
      model.source.extras.push_back(
          {Name(k, c), "float", 4, std::vector<char>(4 * model.NumGaussians(), '\0')});
    }
  }
}

ShBand4 ShBand4Columns::Get(size_t g) const {
  ShBand4 values;
  for (size_t i = 0; i < values.size(); ++i) {
    if (IsDouble(*columns_[i])) {
      double value;
      std::memcpy(&value, columns_[i]->bytes.data() + 8 * g, sizeof(value));
      values[i] = static_cast<float>(value);
    } else {
      std::memcpy(&values[i], columns_[i]->bytes.data() + 4 * g, sizeof(float));
    }
  }
  return values;
}

void ShBand4Columns::Set(size_t g, const ShBand4& values) {
  for (size_t i = 0; i < values.size(); ++i) {
    if (IsDouble(*columns_[i])) {
      const double value = static_cast<double>(values[i]);
      std::memcpy(columns_[i]->bytes.data() + 8 * g, &value, sizeof(value));
    } else {
      std::memcpy(columns_[i]->bytes.data() + 4 * g, &values[i], sizeof(float));
    }
  }
}

bool HasShBand4(const GaussianModel& model) {
  for (const ExtraColumn& extra : model.source.extras) {
    if (extra.name == ShBand4Columns::Name(kEnd - 1, 2)) return model.sh_degree == 3;
  }
  return false;
}

}  // namespace retint
