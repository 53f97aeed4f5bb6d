// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/jpeg_decode.h"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
// After <cstdio>, whose FILE it uses without including it.
#include <jpeglib.h>
// The codes of its messages.
#include <jerror.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"

namespace retint {
namespace {

// libjpeg reports through these; an error jumps back, for libjpeg's frames cannot be unwound.
struct Reporter {
  jpeg_error_mgr manager;  // first, so that a pointer to it is one to the whole
  std::jmp_buf back;
  char fault[JMSG_LENGTH_MAX];
};

void OnError(j_common_ptr info) {
  auto* reporter = reinterpret_cast<Reporter*>(info->err);
  info->err->format_message(info, reporter->fault);
  std::longjmp(reporter->back, 1);
}

// Cameras pad their files before markers, which harms nothing. Every other warning means that part
// of the picture is made up.
void OnMessage(j_common_ptr info, int level) {
  if (level < 0 && info->err->msg_code != JWRN_EXTRANEOUS_DATA) OnError(info);
}

void Silence(j_common_ptr) {}

bool IsInk(J_COLOR_SPACE space) { return space == JCS_CMYK || space == JCS_YCCK; }

// The rest of white after four inks. Adobe's files, which say so, store the light that each ink
// lets through (255: no ink), others the ink.
void RgbFromInk(const std::vector<JSAMPLE>& row, bool adobe, JSAMPLE* rgb) {
  for (size_t x = 0; x < row.size() / 4; ++x) {
    const auto light = [&](size_t c) {
      const int value = row[4 * x + c];
      return adobe ? value : 255 - value;
    };
    for (size_t c = 0; c < 3; ++c) {
      rgb[3 * x + c] = static_cast<JSAMPLE>((light(c) * light(3) + 127) / 255);
    }
  }
}

void Report(Reporter& reporter, jpeg_error_mgr*& manager) {
  manager = jpeg_std_error(&reporter.manager);
  reporter.manager.error_exit = OnError;
  reporter.manager.emit_message = OnMessage;
  reporter.manager.output_message = Silence;
}

// Into `out` and `ink`, which the caller owns: nothing here has a destructor that a jump would
// skip.
bool Decode(std::string_view bytes, jpeg_decompress_struct& jpeg, Reporter& reporter, Image8& out,
            std::vector<JSAMPLE>& ink) {
  Report(reporter, jpeg.err);
  if (setjmp(reporter.back) != 0) return false;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&jpeg, TRUE);
  const bool is_ink = IsInk(jpeg.jpeg_color_space);
  jpeg.out_color_space = is_ink ? JCS_CMYK : JCS_RGB;
  jpeg_start_decompress(&jpeg);
  out.width = static_cast<int>(jpeg.output_width);
  out.height = static_cast<int>(jpeg.output_height);
  out.data.resize(out.NumPixels() * 3);
  if (is_ink) ink.resize(size_t{jpeg.output_width} * 4);
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW rgb = out.data.data() + out.Index(0, static_cast<int>(jpeg.output_scanline));
    JSAMPROW row = is_ink ? ink.data() : rgb;
    jpeg_read_scanlines(&jpeg, &row, 1);
    if (is_ink) RgbFromInk(ink, jpeg.saw_Adobe_marker, rgb);
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

// `picture` with the tables of `like`, whose header is read; of a gray file, if those are taken,
// its one table for all channels. `to` is malloc's, the caller's.
bool Encode(const Image8& picture, std::string_view like, bool takes_gray,
            jpeg_decompress_struct& source, jpeg_compress_struct& jpeg, Reporter& reporter,
            unsigned char*& to, unsigned long& size) {
  Report(reporter, source.err);
  jpeg.err = source.err;
  if (setjmp(reporter.back) != 0) return false;
  jpeg_create_decompress(&source);
  jpeg_create_compress(&jpeg);
  jpeg_mem_src(&source, reinterpret_cast<const unsigned char*>(like.data()), like.size());
  jpeg_read_header(&source, TRUE);
  const bool has_colors = source.num_components == 3 && (source.jpeg_color_space == JCS_YCbCr ||
                                                         source.jpeg_color_space == JCS_RGB);
  const bool is_gray = takes_gray && source.num_components == 1;
  if (!has_colors && !is_gray) return false;
  // The tables of a progressive file may come after its header.
  jpeg_start_decompress(&source);
  jpeg_mem_dest(&jpeg, &to, &size);
  jpeg.image_width = static_cast<JDIMENSION>(picture.width);
  jpeg.image_height = static_cast<JDIMENSION>(picture.height);
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_colorspace(&jpeg, is_gray ? JCS_YCbCr : source.jpeg_color_space);
  for (int i = 0; i < NUM_QUANT_TBLS; ++i) {
    const JQUANT_TBL* table = source.quant_tbl_ptrs[i];
    if (!table) continue;
    unsigned int values[DCTSIZE2];
    for (int k = 0; k < DCTSIZE2; ++k) values[k] = table->quantval[k];
    jpeg_add_quant_table(&jpeg, i, values, 100, FALSE);
  }
  for (int c = 0; c < 3; ++c) {
    const jpeg_component_info& from = source.comp_info[is_gray ? 0 : c];
    jpeg.comp_info[c].h_samp_factor = is_gray ? 1 : from.h_samp_factor;
    jpeg.comp_info[c].v_samp_factor = is_gray ? 1 : from.v_samp_factor;
    jpeg.comp_info[c].quant_tbl_no = from.quant_tbl_no;
  }
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    JSAMPROW row = const_cast<JSAMPROW>(picture.data.data() +
                                        picture.Index(0, static_cast<int>(jpeg.next_scanline)));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

// A malloc's file of libjpeg as a string.
std::string Taken(unsigned char* bytes, unsigned long size) {
  std::string text(reinterpret_cast<const char*>(bytes), size);
  std::free(bytes);
  return text;
}

std::optional<std::string> EncodeLike(const Image8& picture, std::string_view like,
                                      bool takes_gray) {
  jpeg_decompress_struct source{};
  jpeg_compress_struct jpeg{};
  Reporter reporter{};
  unsigned char* to = nullptr;
  unsigned long size = 0;
  const bool encoded =
      !picture.Empty() && Encode(picture, like, takes_gray, source, jpeg, reporter, to, size);
  jpeg_destroy_decompress(&source);
  jpeg_destroy_compress(&jpeg);
  std::string bytes = Taken(to, encoded ? size : 0);
  return encoded ? std::optional(std::move(bytes)) : std::nullopt;
}

// Drops JFIF's and Adobe's own segments, because libjpeg writes them, and an index of further
// pictures behind the first (MPF, CIPA DC-007), which is wrong once the first has another length.
bool IsKept(const jpeg_marker_struct& marker, bool profile) {
  const std::string_view data(reinterpret_cast<const char*>(marker.data), marker.data_length);
  if (marker.marker == JPEG_APP0) return !data.starts_with(std::string_view("JFIF\0", 5));
  if (marker.marker == JPEG_APP0 + 14) return !data.starts_with("Adobe");
  if (marker.marker != JPEG_APP0 + 2) return true;
  if (data.starts_with("ICC_PROFILE")) return profile;
  return !data.starts_with(std::string_view("MPF\0", 4));
}

// All segments of metadata, as jpegtran copies them.
void SaveMarkers(jpeg_decompress_struct& jpeg) {
  jpeg_save_markers(&jpeg, JPEG_COM, 0xFFFF);
  for (int k = 0; k < 16; ++k) jpeg_save_markers(&jpeg, JPEG_APP0 + k, 0xFFFF);
}

struct Merge {
  jpeg_decompress_struct old{}, edited{};
  jpeg_compress_struct jpeg{};
  Reporter reporter{};
  unsigned char* to = nullptr;
  unsigned long size = 0;
};

// The coefficients of `to` in the blocks that do not change, from `from`. `changed` has a byte for
// each 8 x 8 pixels of the picture.
void KeepBlocks(Merge& merge, jvirt_barray_ptr* from, jvirt_barray_ptr* to, const Mask& changed) {
  for (int c = 0; c < merge.old.num_components; ++c) {
    const jpeg_component_info& info = merge.old.comp_info[c];
    // Sides of a block of this component, in blocks of the picture.
    const int wide = merge.old.max_h_samp_factor / info.h_samp_factor;
    const int high = merge.old.max_v_samp_factor / info.v_samp_factor;
    for (int row = 0; row < int(info.height_in_blocks); ++row) {
      auto* const access = merge.old.mem->access_virt_barray;
      const auto r = JDIMENSION(row);
      JBLOCKARRAY source = access(j_common_ptr(&merge.old), from[c], r, 1, FALSE);
      JBLOCKARRAY target = access(j_common_ptr(&merge.edited), to[c], r, 1, TRUE);
      for (int column = 0; column < int(info.width_in_blocks); ++column) {
        bool keeps = true;
        for (int y = row * high; y < (row + 1) * high && keeps; ++y) {
          for (int x = column * wide; x < (column + 1) * wide && keeps; ++x) {
            keeps = !changed.Contains(x, y) || changed(x, y) == 0;
          }
        }
        if (keeps) std::copy_n(source[0][column], DCTSIZE2, target[0][column]);
      }
    }
  }
}

// The file `edited` with the segments of `like` and, where both have the same channels, its blocks
// that do not change. Nothing here has a destructor that a jump would skip.
bool MergeFiles(std::string_view like, std::string_view edited, const Mask& changed, Merge& merge) {
  Report(merge.reporter, merge.old.err);
  merge.edited.err = merge.jpeg.err = merge.old.err;
  if (setjmp(merge.reporter.back) != 0) return false;
  jpeg_create_decompress(&merge.old);
  jpeg_create_decompress(&merge.edited);
  jpeg_create_compress(&merge.jpeg);
  const auto read = [](jpeg_decompress_struct& jpeg, std::string_view bytes) {
    jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    SaveMarkers(jpeg);
    jpeg_read_header(&jpeg, TRUE);
    return jpeg_read_coefficients(&jpeg);
  };
  jvirt_barray_ptr* const from = read(merge.old, like);
  jvirt_barray_ptr* const to = read(merge.edited, edited);
  const bool same_channels = merge.old.num_components == merge.edited.num_components;
  if (same_channels) KeepBlocks(merge, from, to, changed);
  jpeg_compress_struct& jpeg = merge.jpeg;
  jpeg_mem_dest(&jpeg, &merge.to, &merge.size);
  jpeg_copy_critical_parameters(&merge.edited, &jpeg);
  jpeg.optimize_coding = TRUE;
  if (merge.old.saw_JFIF_marker) {
    jpeg.JFIF_major_version = merge.old.JFIF_major_version;
    jpeg.JFIF_minor_version = merge.old.JFIF_minor_version;
    jpeg.density_unit = merge.old.density_unit;
    jpeg.X_density = merge.old.X_density;
    jpeg.Y_density = merge.old.Y_density;
  }
  jpeg.write_JFIF_header = merge.old.saw_JFIF_marker;
  if (merge.old.progressive_mode) jpeg_simple_progression(&jpeg);
  jpeg_write_coefficients(&jpeg, to);
  for (const jpeg_marker_struct* one = merge.old.marker_list; one; one = one->next) {
    if (!IsKept(*one, same_channels)) continue;
    jpeg_write_marker(&jpeg, one->marker, one->data, one->data_length);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

// A byte for each 8 x 8 pixels: whether any of them differs.
Mask ChangedBlocks(const Image8& a, const Image8& b) {
  Mask changed((a.width + DCTSIZE - 1) / DCTSIZE, (a.height + DCTSIZE - 1) / DCTSIZE);
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      const size_t at = a.Index(x, y);
      if (!std::equal(&a.data[at], &a.data[at] + 3, &b.data[at])) {
        changed(x / DCTSIZE, y / DCTSIZE) = 255;
      }
    }
  }
  return changed;
}

}  // namespace

bool IsJpeg(std::string_view bytes) { return bytes.starts_with("\xFF\xD8\xFF"); }

Image8 DecodeJpeg(std::string_view bytes, const std::filesystem::path& path) {
  Image8 out;
  jpeg_decompress_struct jpeg{};
  Reporter reporter{};
  std::vector<JSAMPLE> ink;
  const bool decoded = Decode(bytes, jpeg, reporter, out, ink);
  jpeg_destroy_decompress(&jpeg);
  if (!decoded) throw InputError(path, std::string("damaged JPEG file: ") + reporter.fault);
  return out;
}

std::optional<Image8> RecodeJpeg(const Image8& picture, std::string_view like) {
  const auto bytes = EncodeLike(picture, like, /*takes_gray=*/false);
  return bytes ? std::optional(DecodeJpeg(*bytes, {})) : std::nullopt;
}

std::string WithPixels(const Image8& picture, const Image8& held, std::string_view like,
                       const std::filesystem::path& path) {
  const auto edited = EncodeLike(picture, like, /*takes_gray=*/true);
  if (!edited) throw InputError(path, "is a JPEG of inks (CMYK): save it in RGB");
  Merge merge;
  const bool merged = MergeFiles(like, *edited, ChangedBlocks(picture, held), merge);
  jpeg_destroy_decompress(&merge.old);
  jpeg_destroy_decompress(&merge.edited);
  jpeg_destroy_compress(&merge.jpeg);
  std::string bytes = Taken(merge.to, merged ? merge.size : 0);
  if (!merged) throw InputError(path, std::string("damaged JPEG file: ") + merge.reporter.fault);
  return bytes;
}

}  // namespace retint
