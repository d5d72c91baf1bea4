/// Decodes and encodes PNG images in memory with libpng's simplified interface.
#pragma once

#include <png.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace dtsdf {

/// Drops the ancillary chunks of a PNG: with a gAMA or sRGB chunk, libpng would convert the values.
/// Keeps invalid chunks, so that libpng rejects the file.
inline std::string criticalChunks(const uint8_t* data, size_t bytes) {
  constexpr size_t kSignatureBytes = 8, kEmptyChunkBytes = 12;
  constexpr uint8_t kAncillary = 0x20;  // bit in the first letter of a chunk's type
  const uint8_t* const end = data + bytes;
  std::string kept;
  for (size_t length = std::min(bytes, kSignatureBytes); data < end; data += length) {
    const auto left = static_cast<size_t>(end - data);
    const bool is_chunk = left >= kEmptyChunkBytes && png_get_uint_32(data) <= PNG_UINT_31_MAX;
    if (!kept.empty()) length = is_chunk ? kEmptyChunkBytes + png_get_uint_32(data) : left;
    length = std::min(length, left);
    if (kept.empty() || !is_chunk || (data[4] & kAncillary) == 0) {
      kept.append(reinterpret_cast<const char*>(data), length);
    }
  }
  return kept;
}

class PngReader {
 public:
  PngReader(const void* data, size_t bytes)
      : file_(criticalChunks(static_cast<const uint8_t*>(data), bytes)),
        is_png_(png_image_begin_read_from_memory(&png_, file_.data(), file_.size()) != 0) {}
  ~PngReader() { png_image_free(&png_); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// False if it is not a PNG image, or its header is damaged.
  bool isPng() const { return is_png_; }
  std::string problem() const { return std::string("PNG: ") + png_.message; }
  size_t width() const { return png_.width; }
  size_t height() const { return png_.height; }
  bool is16BitGrey() const { return png_.format == PNG_FORMAT_LINEAR_Y; }
  /// Works for any colour type. @pre isPng()
  bool isInterlaced16Bit() const {
    constexpr size_t kBitDepthAt = 24, kInterlaceAt = 28;
    return file_[kBitDepthAt] == 16 && file_[kInterlaceAt] != 0;
  }
  bool hasAlpha() const { return (png_.format & PNG_FORMAT_FLAG_ALPHA) != 0; }

  /// Decodes the pixels, in one of libpng's formats; call it only once. @return false if they are
  /// damaged.
  bool read(png_uint_32 format, png_uint_32 flags, void* rows) {
    png_.format = format;
    png_.flags |= flags;
    return png_image_finish_read(&png_, nullptr, rows, 0, nullptr) != 0;
  }

 private:
  const std::string file_;
  png_image png_ = {nullptr, PNG_IMAGE_VERSION, 0, 0, 0, 0, 0, 0, {}};
  const bool is_png_;
};

/// Encodes an image. @param format One of libpng's formats. @throws std::runtime_error
inline std::string pngBytes(int width, int height, png_uint_32 format, const void* pixels) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = format;
  png.flags = PNG_IMAGE_FLAG_FAST;  // encodes in a third of the time
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(png), '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&png, &bytes[0], &size, 0, pixels, 0, nullptr) == 0) {
    throw std::runtime_error(std::string("cannot encode a PNG image: ") + png.message);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace dtsdf
