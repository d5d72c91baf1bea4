#include "io/colour_codes.h"

#include <cstdio>  // before jpeglib.h, which needs it

#include <jpeglib.h>

#include <csetjmp>
#include <memory>
#include <stdexcept>

#include "io/png_memory.h"
#include "io/text_file.h"
#include "kernels/core/voxel.h"

namespace dtsdf {
namespace {

/// Before memory is taken for it. @throws std::runtime_error
void checkSize(size_t width, size_t height, const std::string& name) {
  if (width > 0 && height > 0 && width <= static_cast<size_t>(kMaxPixels) / height) return;
  throw std::runtime_error(name + " has more than " + std::to_string(kMaxPixels) + " pixels");
}

/// Whatever is in the file becomes 8 bits of red, green and blue.
void askForRgb(png_structp png, png_infop info) {
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_strip_alpha(png);
  if (!(png_get_color_type(png, info) & PNG_COLOR_MASK_COLOR)) png_set_gray_to_rgb(png);
}

/// @return false: it is damaged.
bool readPng(const uint8_t* data, size_t bytes, const std::string& name, RgbImage& image) {
  PngReader png(data, bytes);
  if (!png.readHeader()) return false;
  checkSize(png.width(), png.height(), name);
  image.width = static_cast<int>(png.width());
  image.height = static_cast<int>(png.height());
  const size_t row_bytes = 3 * png.width();
  image.values.resize(row_bytes * png.height());
  return png.readRows(askForRgb, row_bytes, image.values.data());
}

struct JpegErrors {
  jpeg_error_mgr manager;  ///< First, so that a pointer to it is one to this.
  std::jmp_buf target;
};

[[noreturn]] void onJpegError(j_common_ptr jpeg) {
  std::longjmp(reinterpret_cast<JpegErrors*>(jpeg->err)->target, 1);
}

/// libjpeg reports errors by a jump out of its calls: here is nothing that needs a destructor.
/// @return false: it is damaged.
bool readRows(jpeg_decompress_struct& jpeg, JpegErrors& errors, const uint8_t* data, size_t bytes,
              const std::string& name, RgbImage& image) {
  if (setjmp(errors.target) != 0) return false;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, data, bytes);
  jpeg_read_header(&jpeg, TRUE);
  checkSize(jpeg.image_width, jpeg.image_height, name);
  jpeg.out_color_space = JCS_RGB;
  jpeg_start_decompress(&jpeg);
  image.width = static_cast<int>(jpeg.output_width);
  image.height = static_cast<int>(jpeg.output_height);
  const size_t row_bytes = 3 * static_cast<size_t>(image.width);
  image.values.resize(row_bytes * image.height);
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW row = image.values.data() + jpeg.output_scanline * row_bytes;
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_decompress(&jpeg);
  // A file that ends early is filled up with grey, which is no picture of anything.
  return errors.manager.num_warnings == 0;
}

bool readJpeg(const uint8_t* data, size_t bytes, const std::string& name, RgbImage& image) {
  JpegErrors errors;
  jpeg_decompress_struct jpeg = {};
  jpeg.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = onJpegError;
  errors.manager.emit_message = [](j_common_ptr info, int level) {
    if (level < 0) ++info->err->num_warnings;
  };
  const std::unique_ptr<jpeg_decompress_struct, decltype(&jpeg_destroy_decompress)> destroyed(
      &jpeg, &jpeg_destroy_decompress);
  return readRows(jpeg, errors, data, bytes, name, image);
}

}  // namespace

RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name) {
  RgbImage image;
  const bool is_jpeg = bytes >= 2 && data[0] == 0xff && data[1] == 0xd8;
  const bool is_read = PngReader::isPng(data, bytes)
                           ? readPng(data, bytes, name, image)
                           : is_jpeg && readJpeg(data, bytes, name, image);
  if (is_read) return image;
  throw std::runtime_error("cannot decode " + name + ": neither PNG nor JPEG, or damaged");
}

RgbImage readColourImage(const std::string& path) {
  const std::string file = readTextFile(path, "a colour image is expected there");
  return decodeColour(reinterpret_cast<const uint8_t*>(file.data()), file.size(), "'" + path + "'");
}

std::string encodeColourPng(const RgbImage& image) {
  return pngBytes(image.width, image.height, PNG_FORMAT_RGB, image.values.data());
}

}  // namespace dtsdf
