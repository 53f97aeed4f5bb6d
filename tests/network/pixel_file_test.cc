// SPDX-License-Identifier: BSD-3-Clause
#include "network/pixel_file.h"

#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class PixelFile : public testing::Test {
 protected:
  ScalarImage Read(const std::string& name, const std::string& bytes) {
    WriteFile(folder_ / name, bytes);
    return ReadPixels(folder_ / name);
  }
  std::string Fault(const std::string& name, const std::string& bytes) {
    try {
      Read(name, bytes);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing";
  }
  TempFolder folder_;
};

template <typename T>
std::string Bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::string Npy(const std::string& type, const std::string& shape, const std::string& bytes,
                const std::string& fortran = "False") {
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': " + fortran + ", 'shape': (" + shape + "), }";
  header.resize(118, ' ');
  return std::string("\x93NUMPY\x01\x00", 8) + char(header.size()) + char(0) + header + bytes;
}

TEST_F(PixelFile, NpyOfAnyUsualType) {
  const auto read = [&](const std::string& type, const std::string& bytes) {
    return Read("a.npy", Npy(type, "1, 2, 2", bytes)).data;
  };
  const auto expected = ElementsAre(1, 2, 3, 0);
  EXPECT_THAT(read("<f4", Bytes<float>({1, 2, 3, 0})), expected);
  EXPECT_THAT(read("<f8", Bytes<double>({1, 2, 3, 0})), expected);
  EXPECT_THAT(read("<f2", Bytes<uint16_t>({0x3c00, 0x4000, 0x4200, 0})), expected);
  EXPECT_THAT(read(">f4", Bytes<uint32_t>({0x803f, 0x40, 0x4040, 0})), expected);
  EXPECT_THAT(read("<i4", Bytes<int32_t>({1, 2, 3, 0})), expected);
  EXPECT_THAT(read("<u2", Bytes<uint16_t>({1, 2, 3, 0})), expected);
  EXPECT_THAT(read("|u1", Bytes<uint8_t>({1, 2, 3, 0})), expected);
  EXPECT_THAT(read("|b1", Bytes<uint8_t>({1, 0, 1, 0})), ElementsAre(1, 0, 1, 0));
}

TEST_F(PixelFile, NpyShapesAreHeightFirst) {
  const ScalarImage image = Read("a.npy", Npy("<f4", "3, 2, 1", Bytes<float>({1, 2, 3, 4, 5, 6})));
  EXPECT_EQ(image.width, 2);
  EXPECT_EQ(image.height, 3);
  EXPECT_EQ(image(1, 2), 6);
}

TEST_F(PixelFile, BadNpyIsRefused) {
  const std::string values = Bytes<float>({1, 2, 3, 4});
  const std::string whole = Npy("<f4", "2, 2", values);
  EXPECT_THAT(Fault("a.npy", ""), HasSubstr("is not an .npy file"));
  EXPECT_THAT(Fault("a.npy", whole.substr(0, 40)), HasSubstr("is cut off"));
  EXPECT_THAT(Fault("a.npy", whole.substr(0, whole.size() - 1)), HasSubstr("as many numbers"));
  EXPECT_THAT(Fault("a.npy", Npy("<f4", "2, 2", values, "True")), HasSubstr("ascontiguousarray"));
  EXPECT_THAT(Fault("a.npy", Npy("<c8", "2, 2", values)), HasSubstr("save float32"));
  EXPECT_THAT(Fault("a.npy", Npy("<f\n", "2, 2", values)), testing::Not(HasSubstr("\n")));
  EXPECT_THAT(Fault("a.npy", Npy("<f4", "2, 2, 2", values)), HasSubstr("[height, width]"));
  EXPECT_THAT(Fault("a.npy", Npy("<f4", "4000000000, 4000000000", values)),
              HasSubstr("more than a picture has"));
}

TEST_F(PixelFile, PfmBeginsAtTheBottom) {
  const ScalarImage image = Read("a.pfm", "Pf\n2 2\n-1.0\n" + Bytes<float>({3, 4, 1, 2}));
  EXPECT_THAT(image.data, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(Read("a.pfm", "Pf\n1 1\n1\n" + Bytes<uint32_t>({0x803f})).data, ElementsAre(1));
  EXPECT_THAT(Fault("a.pfm", "PF\n1 1\n1\n"), HasSubstr("one channel"));
  EXPECT_THAT(Fault("a.pfm", "Pf\n1 1\n1\n"), HasSubstr("as many numbers"));
  EXPECT_THAT(Fault("a.pfm", "Pf\n-1 1\n1\n"), HasSubstr("no pixels"));
}

TEST_F(PixelFile, PngIsGray) {
  Mask mask(2, 1);
  mask.data = {0, 200};
  WritePng(folder_ / "a.png", mask);
  EXPECT_THAT(ReadPixels(folder_ / "a.png").data, ElementsAre(0, testing::FloatNear(200, 1e-3f)));
  EXPECT_THROW(Read("b.png", "nonsense"), InputError);
}

}  // namespace
}  // namespace retint
