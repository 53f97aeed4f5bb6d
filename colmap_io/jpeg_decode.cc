// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/jpeg_decode.h"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
// After <cstdio>, whose FILE it uses without including it.
#include <jpeglib.h>
// The codes of its messages.
#include <jerror.h>

#include <string>
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

// `picture` with the tables of `like`, whose header is read. `to` is malloc's, the caller's.
bool Encode(const Image8& picture, std::string_view like, jpeg_decompress_struct& source,
            jpeg_compress_struct& jpeg, Reporter& reporter, unsigned char*& to,
            unsigned long& size) {
  Report(reporter, source.err);
  jpeg.err = source.err;
  if (setjmp(reporter.back) != 0) return false;
  jpeg_create_decompress(&source);
  jpeg_create_compress(&jpeg);
  jpeg_mem_src(&source, reinterpret_cast<const unsigned char*>(like.data()), like.size());
  jpeg_read_header(&source, TRUE);
  const bool has_colors =
      source.jpeg_color_space == JCS_YCbCr || source.jpeg_color_space == JCS_RGB;
  if (source.num_components != 3 || !has_colors) return false;
  // The tables of a progressive file may come after its header.
  jpeg_start_decompress(&source);
  jpeg_mem_dest(&jpeg, &to, &size);
  jpeg.image_width = static_cast<JDIMENSION>(picture.width);
  jpeg.image_height = static_cast<JDIMENSION>(picture.height);
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_colorspace(&jpeg, source.jpeg_color_space);
  for (int i = 0; i < NUM_QUANT_TBLS; ++i) {
    const JQUANT_TBL* table = source.quant_tbl_ptrs[i];
    if (!table) continue;
    unsigned int values[DCTSIZE2];
    for (int k = 0; k < DCTSIZE2; ++k) values[k] = table->quantval[k];
    jpeg_add_quant_table(&jpeg, i, values, 100, FALSE);
  }
  for (int c = 0; c < 3; ++c) {
    jpeg.comp_info[c].h_samp_factor = source.comp_info[c].h_samp_factor;
    jpeg.comp_info[c].v_samp_factor = source.comp_info[c].v_samp_factor;
    jpeg.comp_info[c].quant_tbl_no = source.comp_info[c].quant_tbl_no;
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
  jpeg_decompress_struct source{};
  jpeg_compress_struct jpeg{};
  Reporter reporter{};
  unsigned char* to = nullptr;
  unsigned long size = 0;
  const bool encoded = !picture.Empty() && Encode(picture, like, source, jpeg, reporter, to, size);
  jpeg_destroy_decompress(&source);
  jpeg_destroy_compress(&jpeg);
  const std::string bytes(reinterpret_cast<const char*>(to), encoded ? size : 0);
  std::free(to);
  if (!encoded) return std::nullopt;
  return DecodeJpeg(bytes, {});
}

}  // namespace retint
