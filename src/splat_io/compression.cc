// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/compression.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <memory>
#include <stdexcept>

namespace retint {
namespace {

constexpr size_t kBlockBytes = size_t{1} << 20;
constexpr int kGzip = 16 + MAX_WBITS;  // zlib: a gzip header, the largest window
constexpr int kZstdLevel = 9;
constexpr size_t kMuch = size_t{64} << 20;  // more than unpacks in a moment

class Inflater {
 public:
  explicit Inflater(std::string_view packed) : packed_(packed) {
    if (inflateInit2(&stream_, kGzip) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  // Unpacks up to `bytes` more into `to`; returns how many. Fewer only at the end of the last
  // stream or of the packed bytes, or at damage. A file may have several streams in a row (RFC
  // 1952, 2.2).
  size_t Next(char* to, size_t bytes) {
    stream_.next_out = reinterpret_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(bytes);
    while (stream_.avail_out > 0 && (code_ == Z_OK || StartNext())) {
      if (stream_.avail_in == 0) {
        const size_t part = std::min(packed_.size(), kBlockBytes);
        if (part == 0) break;
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed_.data()));
        stream_.avail_in = static_cast<uInt>(part);
        packed_.remove_prefix(part);
      }
      code_ = inflate(&stream_, Z_NO_FLUSH);
      if (code_ == Z_BUF_ERROR) code_ = Z_OK;  // needs more input
    }
    return bytes - stream_.avail_out;
  }
  bool Ended() const { return code_ == Z_STREAM_END; }
  bool Damaged() const { return code_ != Z_OK && code_ != Z_STREAM_END; }
  size_t Left() const { return packed_.size() + stream_.avail_in; }

 private:
  // Whether another stream follows after the end of one.
  bool StartNext() {
    const auto left = [&](size_t i) {
      if (i < stream_.avail_in) return stream_.next_in[i];
      i -= stream_.avail_in;
      return i < packed_.size() ? static_cast<Bytef>(packed_[i]) : Bytef{0};
    };
    if (!Ended() || left(0) != 0x1F || left(1) != 0x8B) return false;
    code_ = inflateReset(&stream_);
    return code_ == Z_OK;
  }

  std::string_view packed_;  // not handed to zlib yet
  z_stream stream_{};
  int code_ = Z_OK;
};

// The length, modulo 2^32, at the end of a stream (RFC 1952, 2.3.1). It is that of the last stream,
// so the total is at least as long.
uint32_t LengthAtEnd(std::string_view packed) {
  uint32_t length = 0;
  for (size_t i = 1; i <= std::min<size_t>(4, packed.size()); ++i) {
    length = length << 8 | static_cast<uint8_t>(packed[packed.size() - i]);
  }
  return length;
}

}  // namespace

std::vector<char> GunzipHead(std::string_view packed, size_t wanted) {
  std::vector<char> head(wanted);
  Inflater inflater(packed);
  head.resize(inflater.Next(head.data(), wanted));
  return head;
}

void Gunzip(std::string_view packed, size_t header_bytes,
            const std::function<size_t(std::string_view header)>& limit,
            const std::function<void(size_t done)>& step, UnsetVector<char>& bytes) {
  Inflater inflater(packed);
  bytes.clear();
  const auto grow = [&](size_t more) {
    const size_t done = bytes.size();
    bytes.resize(done + more);
    bytes.resize(done + inflater.Next(bytes.data() + done, more));
    if (inflater.Damaged()) throw std::runtime_error("the compressed data is damaged");
    return bytes.size() - done == more;
  };
  if (!grow(header_bytes)) throw std::runtime_error("truncated: the header is not whole");
  // One byte more than allowed, to notice an excess.
  const size_t most = limit(std::string_view(bytes.data(), bytes.size())) + 1;
  // In a truncated file, this length is arbitrary. A small file is unpacked, for a better message.
  if (most > kMuch && LengthAtEnd(packed) >= most) {
    throw std::runtime_error("holds more data than its header announces, or breaks off");
  }
  // Room for the usual size, so that growing does not copy the bytes.
  bytes.reserve(std::min(most, kUsualRatio * packed.size()));
  while (bytes.size() < most && grow(std::min(kBlockBytes, most - bytes.size()))) {
    step(bytes.size());
  }
  if (bytes.size() >= most) throw std::runtime_error("holds more data than its header announces");
  if (!inflater.Ended()) {
    char one;  // if the last byte filled the block, the trailer may follow
    if (inflater.Next(&one, 1) > 0 || !inflater.Ended()) {
      throw std::runtime_error(inflater.Damaged() ? "the compressed data is damaged"
                                                  : "truncated: the compressed data breaks off");
    }
  }
  if (inflater.Left() > 0) {
    throw std::runtime_error(std::to_string(inflater.Left()) +
                             " bytes follow the compressed data: the file is damaged");
  }
}

std::vector<char> Gzip(std::string_view bytes, const std::function<void(size_t done)>& step) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, 9, Z_DEFAULT_STRATEGY) !=
      Z_OK) {
    throw std::bad_alloc();
  }
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, deflateEnd);
  std::vector<char> packed;
  int code = Z_OK;
  for (size_t done = 0; code == Z_OK;) {
    if (stream.avail_in == 0 && done < bytes.size()) {
      step(done);
      const size_t part = std::min(bytes.size() - done, kBlockBytes);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + done));
      stream.avail_in = static_cast<uInt>(part);
      done += part;
    }
    const size_t was = packed.size();
    packed.resize(was + kBlockBytes);
    stream.next_out = reinterpret_cast<Bytef*>(packed.data() + was);
    stream.avail_out = kBlockBytes;
    code = deflate(&stream, done == bytes.size() ? Z_FINISH : Z_NO_FLUSH);
    packed.resize(was + kBlockBytes - stream.avail_out);
  }
  return packed;
}

std::vector<char> Unzstd(std::string_view packed, size_t bytes, const std::function<void()>& step) {
  const std::unique_ptr<ZSTD_DStream, size_t (*)(ZSTD_DStream*)> stream(ZSTD_createDStream(),
                                                                        ZSTD_freeDStream);
  if (!stream) throw std::bad_alloc();
  const unsigned long long announced = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (announced < ZSTD_CONTENTSIZE_ERROR && announced > bytes) {
    throw std::runtime_error("holds more data than its header announces");
  }
  // A window up to the output's size, or 8 MiB, which every decoder supports.
  const int window_log = std::clamp(static_cast<int>(std::bit_width(bytes)), 23, 30);
  ZSTD_DCtx_setParameter(stream.get(), ZSTD_d_windowLogMax, window_log);
  std::vector<char> out;
  ZSTD_inBuffer in{packed.data(), packed.size(), 0};
  size_t left = 1;  // 0 once the frame is complete
  while (left != 0) {
    step();
    const size_t was = out.size();
    const size_t room = std::min(kBlockBytes, bytes - was + 1);  // one more, to notice an excess
    out.resize(was + room);
    ZSTD_outBuffer to{out.data() + was, room, 0};
    left = ZSTD_decompressStream(stream.get(), &to, &in);
    out.resize(was + to.pos);
    if (ZSTD_isError(left)) throw std::runtime_error("the compressed data is damaged");
    if (out.size() > bytes) throw std::runtime_error("holds more data than its header announces");
    if (left != 0 && to.pos < room && in.pos == in.size) {
      throw std::runtime_error("truncated: the compressed data breaks off");
    }
  }
  if (out.size() != bytes) throw std::runtime_error("holds less data than its header announces");
  if (in.pos != in.size) {
    throw std::runtime_error("bytes follow the compressed data: the file is damaged");
  }
  return out;
}

std::vector<char> Zstd(std::string_view bytes) {
  std::vector<char> packed(ZSTD_compressBound(bytes.size()));
  const size_t size =
      ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size)) throw std::bad_alloc();
  packed.resize(size);
  return packed;
}

}  // namespace retint
