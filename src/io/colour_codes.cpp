#include "io/colour_codes.h"

#include <cstdio>  // before jpeglib.h, which needs it

#include <jpeglib.h>

#include <csetjmp>
#include <stdexcept>

#include "io/png_memory.h"
#include "io/text_file.h"
#include "kernels/core/voxel.h"

namespace dtsdf {
namespace {

struct Bytes {
  const uint8_t* data;
  size_t size;
};

enum class Outcome { kRead, kDamaged, kTooLarge };

bool fits(size_t width, size_t height) {
  return width > 0 && height > 0 && width <= static_cast<size_t>(kMaxPixels) / height;
}

/// Whatever is in the file becomes 8 bits of red, green and blue.
void askForRgb(png_structp png, png_infop info) {
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_strip_alpha(png);
  if (!(png_get_color_type(png, info) & PNG_COLOR_MASK_COLOR)) png_set_gray_to_rgb(png);
}

Outcome readPng(const Bytes& bytes, RgbImage& image) {
  PngReader png(bytes.data, bytes.size);
  if (!png.readHeader()) return Outcome::kDamaged;
  if (!fits(png.width(), png.height())) return Outcome::kTooLarge;
  image.width = static_cast<int>(png.width());
  image.height = static_cast<int>(png.height());
  const size_t row_bytes = 3 * png.width();
  image.rgb.resize(row_bytes * png.height());
  return png.readRows(askForRgb, row_bytes, image.rgb.data()) ? Outcome::kRead : Outcome::kDamaged;
}

struct JpegErrors {
  jpeg_error_mgr manager;  ///< First, so that a pointer to it is one to this.
  std::jmp_buf target;
};

[[noreturn]] void onJpegError(j_common_ptr jpeg) {
  std::longjmp(reinterpret_cast<JpegErrors*>(jpeg->err)->target, 1);
}

/// libjpeg reports errors by a jump out of its calls: here is nothing that needs a destructor.
Outcome readRows(jpeg_decompress_struct& jpeg, JpegErrors& errors, const Bytes& bytes,
                 RgbImage& image) {
  if (setjmp(errors.target) != 0) return Outcome::kDamaged;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, bytes.data, bytes.size);
  jpeg_read_header(&jpeg, TRUE);
  if (!fits(jpeg.image_width, jpeg.image_height)) return Outcome::kTooLarge;
  jpeg.out_color_space = JCS_RGB;
  jpeg_start_decompress(&jpeg);
  image.width = static_cast<int>(jpeg.output_width);
  image.height = static_cast<int>(jpeg.output_height);
  const size_t row_bytes = 3 * static_cast<size_t>(image.width);
  image.rgb.resize(row_bytes * image.height);
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW row = image.rgb.data() + jpeg.output_scanline * row_bytes;
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_decompress(&jpeg);
  // A file that ends early is filled up with grey, which is no picture of anything.
  return errors.manager.num_warnings > 0 ? Outcome::kDamaged : Outcome::kRead;
}

Outcome readJpeg(const Bytes& bytes, RgbImage& image) {
  JpegErrors errors;
  jpeg_decompress_struct jpeg = {};
  jpeg.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = onJpegError;
  errors.manager.emit_message = [](j_common_ptr info, int level) {
    if (level < 0) ++info->err->num_warnings;
  };
  const Outcome outcome = readRows(jpeg, errors, bytes, image);
  jpeg_destroy_decompress(&jpeg);
  return outcome;
}

Outcome readEither(const Bytes& bytes, RgbImage& image) {
  if (PngReader::isPng(bytes.data, bytes.size)) return readPng(bytes, image);
  const bool is_jpeg = bytes.size >= 2 && bytes.data[0] == 0xff && bytes.data[1] == 0xd8;
  return is_jpeg ? readJpeg(bytes, image) : Outcome::kDamaged;
}

}  // namespace

RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name) {
  RgbImage image;
  switch (readEither({data, bytes}, image)) {
    case Outcome::kRead: return image;
    case Outcome::kTooLarge:
      throw std::runtime_error(name + " has more than " + std::to_string(kMaxPixels) + " pixels");
    case Outcome::kDamaged: break;
  }
  throw std::runtime_error("cannot decode " + name + ": neither PNG nor JPEG, or damaged");
}

RgbImage readColourImage(const std::string& path) {
  const std::string file = readTextFile(path, "a colour image is expected there");
  return decodeColour(reinterpret_cast<const uint8_t*>(file.data()), file.size(), "'" + path + "'");
}

std::string encodeColourPng(const RgbImage& image) {
  return pngBytes(image.width, image.height, PNG_FORMAT_RGB, image.rgb.data());
}

}  // namespace dtsdf
