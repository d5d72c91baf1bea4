#include "io/colour_png.h"

#include "io/png_bytes.h"

namespace dtsdf {

std::string encodeColourPng(const ColourImage& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  return pngBytes(png, image.rgb.data());
}

}  // namespace dtsdf
