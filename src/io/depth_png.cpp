#include "io/depth_png.h"

#include <stdexcept>

#include "io/byte_order.h"
#include "io/png_memory.h"
#include "io/text_file.h"
#include "kernels/core/voxel.h"

namespace dtsdf {
namespace {

ImageSize sizeOf(const PngReader& png) {
  return {static_cast<int>(png.width()), static_cast<int>(png.height())};
}

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
    throw std::runtime_error(name + " has " + inWords(sizeOf(png)) + " pixels, more than the " +
                             std::to_string(kMaxPixels) + " that are supported");
  }
}

std::vector<uint16_t> readPixels(PngReader& png, const std::string& name) {
  std::vector<uint16_t> pixels(png.width() * png.height());
  const auto prepare = [](png_structp reader, png_infop) {
    if (hostIsLittleEndian()) png_set_swap(reader);  // the file is big-endian
  };
  if (!png.readRows(prepare, png.width() * sizeof(uint16_t),
                    reinterpret_cast<uint8_t*>(pixels.data()))) {
    throw std::runtime_error("cannot decode " + name + ": not a PNG image, or damaged");
  }
  return pixels;
}

/// The image of a file whose header was read.
class DepthPngFile {
 public:
  explicit DepthPngFile(const std::string& path)
      : bytes_(readTextFile(path, "a depth image is expected there")),
        png_(reinterpret_cast<const uint8_t*>(bytes_.data()), bytes_.size()) {
    readHeader(png_, "'" + path + "'");
  }
  PngReader& png() { return png_; }

 private:
  const std::string bytes_;
  PngReader png_;
};

}  // namespace

std::vector<uint16_t> readDepthPng(const std::string& path, ImageSize expected) {
  DepthPngFile file(path);
  const ImageSize size = sizeOf(file.png());
  if (size.width != expected.width || size.height != expected.height) {
    throw std::runtime_error("'" + path + "' is " + inWords(size) + " pixels, but the camera has " +
                             inWords(expected));
  }
  return readPixels(file.png(), "'" + path + "'");
}

ImageSize readDepthPngSize(const std::string& path) { return sizeOf(DepthPngFile(path).png()); }

DepthImage decodeDepthPng(const uint8_t* data, size_t bytes) {
  const std::string name = "the compressed image";
  PngReader png(data, bytes);
  readHeader(png, name);
  return {sizeOf(png), readPixels(png, name)};
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
