#include "io/depth_png.h"

#include <png.h>

#include <csetjmp>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

namespace dtsdf {
namespace {

constexpr size_t kSignatureBytes = 8;

bool hostIsLittleEndian() {
  const uint16_t probe = 1;
  return *reinterpret_cast<const uint8_t*>(&probe) == 1;
}

/// An open file and libpng's state for it. libpng reports errors by a jump out of its calls, so
/// each function that calls it sets the target first and holds nothing that needs a destructor.
class PngFile {
 public:
  explicit PngFile(const std::string& path) : file_(std::fopen(path.c_str(), "rb")) {
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, onError, onWarning);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngFile() {
    png_destroy_read_struct(&png_, &info_, nullptr);
    if (file_ != nullptr) std::fclose(file_);
  }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;

  bool readHeader() {
    png_byte signature[kSignatureBytes];
    if (file_ == nullptr || info_ == nullptr ||
        std::fread(signature, 1, kSignatureBytes, file_) != kSignatureBytes ||
        png_sig_cmp(signature, 0, kSignatureBytes) != 0) {
      return false;
    }
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_init_io(png_, file_);
    png_set_sig_bytes(png_, kSignatureBytes);
    png_read_info(png_, info_);
    return true;
  }

  /// Fills width x height pixels.
  bool readPixels(uint16_t* pixels) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    if (hostIsLittleEndian()) png_set_swap(png_);  // the file is big-endian
    const int passes = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    for (int pass = 0; pass < passes; ++pass) {
      for (size_t row = 0; row < height(); ++row) {
        png_read_row(png_, reinterpret_cast<png_bytep>(pixels + row * width()), nullptr);
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

  std::FILE* file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

std::vector<uint16_t> readDepthPng(const std::string& path, int width, int height) {
  if (!std::filesystem::is_regular_file(path)) {
    throw std::runtime_error("cannot read '" + path + "': there is no such file");
  }
  const std::string damaged = "cannot decode '" + path + "': not a PNG image, or damaged";
  PngFile file(path);
  if (!file.readHeader()) throw std::runtime_error(damaged);
  if (!file.is16BitGrey()) {
    throw std::runtime_error("'" + path + "' is not a 16-bit grey image, so it holds no depth");
  }
  if (file.width() != static_cast<size_t>(width) || file.height() != static_cast<size_t>(height)) {
    throw std::runtime_error("'" + path + "' is " + std::to_string(file.width()) + " x " +
                             std::to_string(file.height()) + " pixels, but the camera has " +
                             std::to_string(width) + " x " + std::to_string(height));
  }
  std::vector<uint16_t> pixels(file.width() * file.height());
  if (!file.readPixels(pixels.data())) throw std::runtime_error(damaged);
  return pixels;
}

}  // namespace dtsdf
