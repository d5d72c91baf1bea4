#include "io/colour_png.h"

#include <png.h>

#include <stdexcept>

namespace dtsdf {

std::string encodeColourPng(const ColourImage& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  // Without a place for the bytes it tells how many there are.
  const auto write = [&](void* bytes, png_alloc_size_t size) {
    if (png_image_write_to_memory(&png, bytes, &size, 0, image.rgb.data(), 0, nullptr) == 0) {
      throw std::runtime_error(std::string("cannot make a PNG image: ") + png.message);
    }
    return size;
  };
  std::string bytes(write(nullptr, 0), '\0');
  write(&bytes[0], bytes.size());
  return bytes;
}

}  // namespace dtsdf
