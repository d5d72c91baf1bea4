#include "io/colour_codes.h"

#include <cstdio>  // before jpeglib.h, which needs it

#include <jpeglib.h>
#include <png.h>

#include <csetjmp>
#include <cstring>
#include <stdexcept>

#include "io/text_file.h"
#include "kernels/core/voxel.h"

namespace dtsdf {
namespace {

constexpr size_t kSignatureBytes = 8;

/// What is left to be read of an image.
struct Bytes {
  const uint8_t* next;
  size_t left;
};

/// What both libraries need that is to be told apart after an error, from which they jump out of
/// their calls: whoever sets the target of a jump holds nothing that needs a destructor.
enum class Outcome { kRead, kDamaged, kTooLarge };

bool fits(size_t width, size_t height) {
  return width > 0 && height > 0 && width <= static_cast<size_t>(kMaxPixels) / height;
}

[[noreturn]] void onPngError(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void onPngWarning(png_structp, png_const_charp) {}

void onPngRead(png_structp png, png_bytep to, png_size_t wanted) {
  auto* const bytes = static_cast<Bytes*>(png_get_io_ptr(png));
  if (wanted > bytes->left) png_error(png, "the end");
  std::memcpy(to, bytes->next, wanted);
  bytes->next += wanted;
  bytes->left -= wanted;
}

/// Whatever is in the file becomes 8 bits of red, green and blue.
void askForRgb(png_structp png, png_infop info) {
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_strip_alpha(png);
  if (!(png_get_color_type(png, info) & PNG_COLOR_MASK_COLOR)) png_set_gray_to_rgb(png);
}

Outcome readRows(png_structp png, png_infop info, Bytes& bytes, DecodedColour& image) {
  if (setjmp(png_jmpbuf(png)) != 0) return Outcome::kDamaged;
  png_set_read_fn(png, &bytes, onPngRead);
  png_read_info(png, info);
  if (!fits(png_get_image_width(png, info), png_get_image_height(png, info))) {
    return Outcome::kTooLarge;
  }
  askForRgb(png, info);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  image.width = static_cast<int>(png_get_image_width(png, info));
  image.height = static_cast<int>(png_get_image_height(png, info));
  const size_t row_bytes = 3 * static_cast<size_t>(image.width);
  if (png_get_rowbytes(png, info) != row_bytes) return Outcome::kDamaged;
  image.rgb.resize(row_bytes * image.height);
  for (int pass = 0; pass < passes; ++pass) {
    for (int v = 0; v < image.height; ++v) {
      png_read_row(png, image.rgb.data() + v * row_bytes, nullptr);
    }
  }
  png_read_end(png, nullptr);
  return Outcome::kRead;
}

Outcome readPng(Bytes& bytes, DecodedColour& image) {
  png_structp png =
      png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, onPngError, onPngWarning);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  const Outcome outcome =
      info == nullptr ? Outcome::kDamaged : readRows(png, info, bytes, image);
  png_destroy_read_struct(&png, &info, nullptr);
  return outcome;
}

struct JpegErrors {
  jpeg_error_mgr manager;  ///< First, so that a pointer to it is one to this.
  std::jmp_buf target;
};

[[noreturn]] void onJpegError(j_common_ptr jpeg) {
  std::longjmp(reinterpret_cast<JpegErrors*>(jpeg->err)->target, 1);
}

Outcome readRows(jpeg_decompress_struct& jpeg, JpegErrors& errors, const Bytes& bytes,
                 DecodedColour& image) {
  if (setjmp(errors.target) != 0) return Outcome::kDamaged;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, bytes.next, bytes.left);
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

Outcome readJpeg(Bytes& bytes, DecodedColour& image) {
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

Outcome readEither(Bytes bytes, DecodedColour& image) {
  if (bytes.left < kSignatureBytes) return Outcome::kDamaged;
  if (png_sig_cmp(bytes.next, 0, kSignatureBytes) == 0) return readPng(bytes, image);
  const bool is_jpeg = bytes.next[0] == 0xff && bytes.next[1] == 0xd8;
  return is_jpeg ? readJpeg(bytes, image) : Outcome::kDamaged;
}

}  // namespace

DecodedColour decodeColour(const uint8_t* data, size_t bytes, const std::string& name) {
  DecodedColour image;
  switch (readEither({data, bytes}, image)) {
    case Outcome::kRead: return image;
    case Outcome::kTooLarge:
      throw std::runtime_error(name + " has more than " + std::to_string(kMaxPixels) + " pixels");
    case Outcome::kDamaged: break;
  }
  throw std::runtime_error("cannot decode " + name + ": neither PNG nor JPEG, or damaged");
}

DecodedColour readColourImage(const std::string& path) {
  const std::string file = readTextFile(path, "a colour image is expected there");
  return decodeColour(reinterpret_cast<const uint8_t*>(file.data()), file.size(), "'" + path + "'");
}

}  // namespace dtsdf
