#include "io/depth_png.h"

#include <png.h>

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "io/byte_order.h"
#include "io/png_bytes.h"
#include "kernels/core/voxel.h"

namespace dtsdf {
namespace {

constexpr size_t kSignatureBytes = 8;

/// Where the bytes of an image come from, in order.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Fills `to`; false if there are not that many bytes left. Holds nothing meanwhile that needs a
  /// destructor, since libpng jumps over it.
  virtual bool read(uint8_t* to, size_t bytes) = 0;
};

class FileBytes : public ByteSource {
 public:
  explicit FileBytes(const std::string& path) : file_(std::fopen(path.c_str(), "rb")) {}
  ~FileBytes() override {
    if (file_ != nullptr) static_cast<void>(std::fclose(file_));  // it was only read
  }
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;

  bool read(uint8_t* to, size_t bytes) override {
    return file_ != nullptr && std::fread(to, 1, bytes, file_) == bytes;
  }

 private:
  std::FILE* file_;
};

class MemoryBytes : public ByteSource {
 public:
  MemoryBytes(const uint8_t* data, size_t bytes) : next_(data), left_(bytes) {}

  bool read(uint8_t* to, size_t bytes) override {
    if (bytes > left_) return false;
    std::memcpy(to, next_, bytes);
    next_ += bytes;
    left_ -= bytes;
    return true;
  }

 private:
  const uint8_t* next_;
  size_t left_;
};

/// libpng's state for one image. libpng reports errors by a jump out of its calls, so each function
/// that calls it sets the target first and holds nothing that needs a destructor.
class PngReader {
 public:
  explicit PngReader(ByteSource& bytes)
      : bytes_(bytes),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, onError, onWarning)) {
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  bool readHeader() {
    png_byte signature[kSignatureBytes];
    if (info_ == nullptr || !bytes_.read(signature, kSignatureBytes) ||
        png_sig_cmp(signature, 0, kSignatureBytes) != 0) {
      return false;
    }
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_set_read_fn(png_, &bytes_, onRead);
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
  ImageSize size() const { return {static_cast<int>(width()), static_cast<int>(height())}; }
  bool is16BitGrey() const {
    return png_get_bit_depth(png_, info_) == 16 &&
           png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY;
  }

 private:
  [[noreturn]] static void onError(png_structp png, png_const_charp) { png_longjmp(png, 1); }
  static void onWarning(png_structp, png_const_charp) {}
  static void onRead(png_structp png, png_bytep to, png_size_t bytes) {
    if (!static_cast<ByteSource*>(png_get_io_ptr(png))->read(to, bytes)) png_error(png, "the end");
  }

  ByteSource& bytes_;
  png_structp png_;
  png_infop info_ = nullptr;
};

std::string inWords(ImageSize size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height);
}

/// `name` is what stands for the image in messages. @throws std::runtime_error
void readHeader(PngReader& png, const std::string& name) {
  if (!png.readHeader()) {
    throw std::runtime_error("cannot decode " + name + ": not a PNG image, or damaged");
  }
  if (!png.is16BitGrey()) {
    throw std::runtime_error(name + " is not a 16-bit grey image, so it is not a depth image");
  }
  if (png.height() > kMaxPixels / png.width()) {  // libpng refuses widths of 0
    throw std::runtime_error(name + " has " + inWords(png.size()) + " pixels, more than the " +
                             std::to_string(kMaxPixels) + " that are supported");
  }
}

std::vector<uint16_t> readPixels(PngReader& png, const std::string& name) {
  std::vector<uint16_t> pixels(png.width() * png.height());
  if (!png.readPixels(pixels.data())) {
    throw std::runtime_error("cannot decode " + name + ": not a PNG image, or damaged");
  }
  return pixels;
}

void requireFile(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw std::runtime_error("cannot read '" + path + "': no such file");
  }
}

}  // namespace

std::vector<uint16_t> readDepthPng(const std::string& path, ImageSize expected) {
  requireFile(path);
  const std::string name = "'" + path + "'";
  FileBytes file(path);
  PngReader png(file);
  readHeader(png, name);
  const ImageSize size = png.size();
  if (size.width != expected.width || size.height != expected.height) {
    throw std::runtime_error(name + " is " + inWords(size) + " pixels, but the camera has " +
                             inWords(expected));
  }
  return readPixels(png, name);
}

ImageSize readDepthPngSize(const std::string& path) {
  requireFile(path);
  FileBytes file(path);
  PngReader png(file);
  readHeader(png, "'" + path + "'");
  return png.size();
}

DepthImage decodeDepthPng(const uint8_t* data, size_t bytes) {
  const std::string name = "the compressed image";
  MemoryBytes memory(data, bytes);
  PngReader png(memory);
  readHeader(png, name);
  return {png.size(), readPixels(png, name)};
}

std::string encodeDepthPng(const DepthImage& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.size.width);
  png.height = static_cast<png_uint_32>(image.size.height);
  png.format = PNG_FORMAT_LINEAR_Y;  // 16 bits of grey, as they are
  png.flags = PNG_IMAGE_FLAG_FAST;
  return pngBytes(png, image.pixels.data());
}

}  // namespace dtsdf
