// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/jpeg_decode.h"

#include <csetjmp>
#include <cstdio>
// After <cstdio>, whose FILE it uses without including it.
#include <jpeglib.h>
// The codes of its messages.
#include <jerror.h>

#include <string>

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

// Into `out`, which the caller owns: nothing here has a destructor that a jump would skip.
bool Decode(std::string_view bytes, jpeg_decompress_struct& jpeg, Reporter& reporter, Image8& out) {
  jpeg.err = jpeg_std_error(&reporter.manager);
  reporter.manager.error_exit = OnError;
  reporter.manager.emit_message = OnMessage;
  reporter.manager.output_message = Silence;
  if (setjmp(reporter.back) != 0) return false;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&jpeg, TRUE);
  jpeg.out_color_space = JCS_RGB;
  jpeg_start_decompress(&jpeg);
  out.width = static_cast<int>(jpeg.output_width);
  out.height = static_cast<int>(jpeg.output_height);
  out.data.resize(out.NumPixels() * 3);
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW row = out.data.data() + out.Index(0, static_cast<int>(jpeg.output_scanline));
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

}  // namespace

bool IsJpeg(std::string_view bytes) { return bytes.starts_with("\xFF\xD8\xFF"); }

Image8 DecodeJpeg(std::string_view bytes, const std::filesystem::path& path) {
  Image8 out;
  jpeg_decompress_struct jpeg{};
  Reporter reporter{};
  const bool decoded = Decode(bytes, jpeg, reporter, out);
  jpeg_destroy_decompress(&jpeg);
  if (!decoded) throw InputError(path, std::string("damaged JPEG file: ") + reporter.fault);
  return out;
}

}  // namespace retint
