#include "io/colour_codes.h"

#include <turbojpeg.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "io/png_memory.h"
#include "io/text_file.h"
#include "kernels/core/voxel.h"
#include "params/printable.h"

namespace dtsdf {
namespace {

/// @return an image of this size without pixel values. @throws std::runtime_error if it is too
/// large.
RgbImage emptyImage(size_t width, size_t height, const std::string& name) {
  if (width > 0 && height > 0 && width <= static_cast<size_t>(kMaxPixels) / height) {
    return {static_cast<int>(width), static_cast<int>(height), {}};
  }
  throw std::runtime_error(name + " has more than " + std::to_string(kMaxPixels) + " pixels");
}

/// Decodes a PNG to 8-bit RGB. @return an error message, or an empty string.
std::string readPng(const uint8_t* data, size_t bytes, const std::string& name, RgbImage& image) {
  PngReader png(data, bytes);
  if (!png.isPng()) return png.problem();
  if (png.isInterlaced16Bit()) {  // libpng before 1.6.51 overruns the buffer: CVE-2025-65018
    throw std::runtime_error(name +
                             " is an interlaced 16-bit PNG image, which cannot be read safely; "
                             "save it with 8 bits per channel or without interlacing");
  }
  image = emptyImage(png.width(), png.height(), name);
  const size_t pixels = png.width() * png.height(), channels = png.hasAlpha() ? 4 : 3;
  std::vector<uint8_t>& values = image.values;
  values.resize(channels * pixels);
  const png_uint_32 format = png.hasAlpha() ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  if (!png.read(format, PNG_IMAGE_FLAG_16BIT_sRGB, values.data())) return png.problem();
  for (size_t i = 0; channels > 3 && i < pixels; ++i) {
    std::copy_n(values.begin() + 4 * i, 3, values.begin() + 3 * i);
  }
  values.resize(3 * pixels);
  return "";
}

/// Decodes a JPEG to 8-bit RGB. @return an error message, or an empty string.
std::string readJpeg(const uint8_t* data, size_t bytes, const std::string& name, RgbImage& image) {
  const std::unique_ptr<void, decltype(&tjDestroy)> jpeg(tjInitDecompress(), &tjDestroy);
  int width = 0, height = 0, sampling = 0, space = 0;
  if (jpeg == nullptr ||
      tjDecompressHeader3(jpeg.get(), data, bytes, &width, &height, &sampling, &space) != 0) {
    return tjGetErrorStr2(jpeg.get());
  }
  image = emptyImage(static_cast<size_t>(width), static_cast<size_t>(height), name);
  image.values.resize(3 * static_cast<size_t>(width) * static_cast<size_t>(height));
  // Without STOPONWARNING, a truncated image would be filled with grey.
  const int status = tjDecompress2(jpeg.get(), data, bytes, image.values.data(), width, 0, height,
                                   TJPF_RGB, TJFLAG_STOPONWARNING);
  return status == 0 ? "" : tjGetErrorStr2(jpeg.get());
}

}  // namespace

RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name) {
  RgbImage image;
  constexpr size_t kSignatureBytes = 8;
  const bool is_png = bytes >= kSignatureBytes && png_sig_cmp(data, 0, kSignatureBytes) == 0;
  const std::string problem =
      is_png ? readPng(data, bytes, name, image) : readJpeg(data, bytes, name, image);
  if (problem.empty()) return image;
  throw std::runtime_error("cannot decode " + name + ": not a PNG or JPEG, or damaged (" +
                           printable(problem) + ")");
}

RgbImage readColourImage(const std::string& path) {
  const std::string file = readTextFile(path, "expected a colour image");
  return decodeColour(reinterpret_cast<const uint8_t*>(file.data()), file.size(), "'" + path + "'");
}

std::string encodeColourPng(const RgbImage& image) {
  return pngBytes(image.width, image.height, PNG_FORMAT_RGB, image.values.data());
}

}  // namespace dtsdf
