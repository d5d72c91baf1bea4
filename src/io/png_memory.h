/// PNG images in memory, read and made by libpng.
#pragma once

#include <png.h>

#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

namespace dtsdf {

/// libpng's state for one image. libpng reports errors by a jump out of its calls, so each function
/// that calls it sets the target first and holds nothing that needs a destructor.
class PngReader {
 public:
  PngReader(const void* data, size_t bytes)
      : next_(static_cast<const uint8_t*>(data)),
        left_(bytes),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, onError, onWarning)) {
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  static bool isPng(const uint8_t* data, size_t bytes) {
    constexpr size_t kSignatureBytes = 8;
    return bytes >= kSignatureBytes && png_sig_cmp(data, 0, kSignatureBytes) == 0;
  }

  /// Goes before all else; false for what is no PNG image, or damaged.
  bool readHeader() {
    if (info_ == nullptr || !isPng(next_, left_)) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, this, onRead);
    png_read_info(png_, info_);
    return true;
  }

  /// Fills rows of so many bytes, of pixels as `prepare` asks libpng for them; false if they are
  /// damaged.
  bool readRows(void (*prepare)(png_structp, png_infop), size_t row_bytes, uint8_t* rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    prepare(png_, info_);
    const int passes = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    if (png_get_rowbytes(png_, info_) != row_bytes) return false;
    for (int pass = 0; pass < passes; ++pass) {
      for (size_t row = 0; row < height(); ++row) {
        png_read_row(png_, rows + row * row_bytes, nullptr);
      }
    }
    png_read_end(png_, nullptr);
    return true;
  }

  size_t width() const { return png_get_image_width(png_, info_); }
  size_t height() const { return png_get_image_height(png_, info_); }
  bool is16BitGrey() const {
    return png_get_bit_depth(png_, info_) == 16 &&
           png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY;
  }

 private:
  [[noreturn]] static void onError(png_structp png, png_const_charp) { png_longjmp(png, 1); }
  static void onWarning(png_structp, png_const_charp) {}
  static void onRead(png_structp png, png_bytep to, png_size_t bytes) {
    auto* const self = static_cast<PngReader*>(png_get_io_ptr(png));
    if (bytes > self->left_) png_error(png, "the end");
    std::memcpy(to, self->next_, bytes);
    self->next_ += bytes;
    self->left_ -= bytes;
  }

  const uint8_t* next_;  ///< Start of what is left to be read.
  size_t left_;
  png_structp png_;
  png_infop info_ = nullptr;
};

/// The file of an image. @param format As libpng's. @throws std::runtime_error
inline std::string pngBytes(int width, int height, png_uint_32 format, const void* pixels,
                            png_uint_32 flags = 0) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = format;
  png.flags = flags | PNG_IMAGE_FLAG_FAST;  // a third of the time
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(png), '\0');
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&png, &bytes[0], &size, 0, pixels, 0, nullptr) == 0) {
    throw std::runtime_error(std::string("cannot make a PNG image: ") + png.message);
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace dtsdf
