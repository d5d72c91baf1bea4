#include "io/image_codes.h"

#include <turbojpeg.h>

#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "io/text_file.h"
#include "kernels/core/voxel.h"

namespace dtsdf {
namespace {

using File = std::string_view;

constexpr File kPngBegin("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
constexpr size_t kPngHeadBytes = 33;

/// A number in the head of a PNG, highest byte first.
size_t numberAt(File png, size_t at, size_t bytes) {
  size_t number = 0;
  for (size_t i = at; i < at + bytes; ++i) number = number << 8 | static_cast<uint8_t>(png[i]);
  return number;
}

bool isPng(File file) {
  return file.size() >= kPngHeadBytes && file.substr(0, kPngBegin.size()) == kPngBegin;
}

/// An image without pixels, of a size that a file announces. @throws std::runtime_error
template <class Image>
Image ofSize(size_t width, size_t height, const std::string& name) {
  if (width > 0 && height > 0 && width <= kMaxPixels / height) {
    return {static_cast<int>(width), static_cast<int>(height), {}};
  }
  throw std::runtime_error(formatted("%s has %zu x %zu pixels; 1 to %d are supported", name.c_str(),
                                     width, height, kMaxPixels));
}

/// @return whether it could be decoded.
template <class Value>
bool readPng(File file, const std::string& name, int flags, Raster<Value>& image) try {
  image = ofSize<Raster<Value>>(numberAt(file, 16, 4), numberAt(file, 20, 4), name);
  const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<char*>(file.data()));
  const cv::Mat pixels = cv::imdecode(bytes, flags | cv::IMREAD_IGNORE_ORIENTATION);
  const auto* const values = reinterpret_cast<const Value*>(pixels.data);
  image.values.assign(values, values + pixels.total() * static_cast<size_t>(pixels.channels()));
  return !pixels.empty();
} catch (const cv::Exception&) {  // for more pixels on a side than OpenCV takes
  return false;
}

/// @return whether it could be decoded.
bool readJpeg(File file, const std::string& name, RgbImage& image) {
  const std::unique_ptr<void, decltype(&tjDestroy)> jpeg(tjInitDecompress(), &tjDestroy);
  const auto* const data = reinterpret_cast<const unsigned char*>(file.data());
  int width = 0, height = 0, sampling = 0, space = 0;
  if (tjDecompressHeader3(jpeg.get(), data, file.size(), &width, &height, &sampling, &space) != 0) {
    return false;
  }
  image = ofSize<RgbImage>(static_cast<size_t>(width), static_cast<size_t>(height), name);
  image.values.resize(3 * static_cast<size_t>(width) * static_cast<size_t>(height));
  // A file that ends early would be filled up with grey, which is no picture of anything.
  return tjDecompress2(jpeg.get(), data, file.size(), image.values.data(), width, 0, height,
                       TJPF_RGB, TJFLAG_STOPONWARNING) == 0;
}

/// OpenCV has blue first.
void swapRedAndBlue(RgbImage& image) {
  uint8_t* const end = image.values.data() + image.values.size();
  for (uint8_t* pixel = image.values.data(); pixel != end; pixel += 3)
    std::swap(pixel[0], pixel[2]);
}

[[noreturn]] void throwDamaged(const std::string& name, const char* formats) {
  throw std::runtime_error("cannot decode " + name + ": " + formats + ", or damaged");
}

/// @throws std::runtime_error for what is no depth image.
DepthImage depthSizeOf(File file, const std::string& name) {
  if (!isPng(file)) throwDamaged(name, "not a PNG image");
  constexpr size_t k16BitGrey = 0x1000;  // bits of a pixel, and their kind
  if (numberAt(file, 24, 2) == k16BitGrey) {
    return ofSize<DepthImage>(numberAt(file, 16, 4), numberAt(file, 20, 4), name);
  }
  throw std::runtime_error(name + " is not a 16-bit grey image, so it is not a depth image");
}

DepthImage decodeDepth(File file, const std::string& name) {
  DepthImage image = depthSizeOf(file, name);
  if (readPng(file, name, cv::IMREAD_ANYDEPTH, image)) return image;
  throwDamaged(name, "not a PNG image");
}

std::string readDepthFile(const std::string& path) {
  return readTextFile(path, "a depth image is expected there");
}

std::string encode(const cv::Mat& image) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", image, bytes);
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::vector<uint16_t> readDepthPng(const std::string& path, int width, int height) {
  DepthImage image = decodeDepth(readDepthFile(path), "'" + path + "'");
  if (image.width == width && image.height == height) return std::move(image.values);
  throw std::runtime_error(formatted("'%s' is %d x %d pixels, but the camera has %d x %d",
                                     path.c_str(), image.width, image.height, width, height));
}

DepthImage readDepthPngSize(const std::string& path) {
  return depthSizeOf(readDepthFile(path), "'" + path + "'");
}

DepthImage decodeDepthPng(const uint8_t* data, size_t bytes) {
  return decodeDepth({reinterpret_cast<const char*>(data), bytes}, "the compressed image");
}

std::string encodeDepthPng(DepthImage image) {
  return encode({image.height, image.width, CV_16UC1, image.values.data()});
}

RgbImage decodeColour(const uint8_t* data, size_t bytes, const std::string& name) {
  const File file(reinterpret_cast<const char*>(data), bytes);
  RgbImage image;
  if (isPng(file) && readPng(file, name, cv::IMREAD_COLOR, image)) {
    swapRedAndBlue(image);
    return image;
  }
  if (!isPng(file) && readJpeg(file, name, image)) return image;
  throwDamaged(name, "neither PNG nor JPEG");
}

RgbImage readColourImage(const std::string& path) {
  const std::string file = readTextFile(path, "a colour image is expected there");
  return decodeColour(reinterpret_cast<const uint8_t*>(file.data()), file.size(), "'" + path + "'");
}

std::string encodeColourPng(RgbImage image) {
  swapRedAndBlue(image);
  return encode({image.height, image.width, CV_8UC3, image.values.data()});
}

}  // namespace dtsdf
