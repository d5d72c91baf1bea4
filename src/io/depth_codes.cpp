#include "io/depth_codes.h"

#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "io/png_memory.h"
#include "io/records.h"
#include "io/text_file.h"
#include "kernels/core/voxel.h"
#include "params/printable.h"

namespace dtsdf {
namespace {

std::string inWords(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// Checks the header. @param name Identifies the image in error messages.
/// @return an image of the size in the header, without pixels. @throws std::runtime_error
DepthImage readHeader(const PngReader& png, const std::string& name) {
  if (!png.isPng()) {
    throw std::runtime_error("cannot decode " + name + ": not a PNG image, or damaged");
  }
  if (!png.is16BitGrey()) {
    throw std::runtime_error(name + " is not a 16-bit greyscale image, as depth images must be");
  }
  DepthImage image{static_cast<int>(png.width()), static_cast<int>(png.height()), {}};
  if (png.height() > kMaxPixels / png.width()) {  // libpng refuses widths of 0
    throw std::runtime_error(name + " has " + inWords(image.width, image.height) +
                             " pixels, but at most " + std::to_string(kMaxPixels) +
                             " are supported");
  }
  return image;
}

void readPixels(PngReader& png, const std::string& name, DepthImage& image) {
  image.values.resize(png.width() * png.height());
  if (!png.read(PNG_FORMAT_LINEAR_Y, 0, image.values.data())) {
    throw std::runtime_error("cannot decode " + name + ": not a PNG image, or damaged");
  }
}

std::string readDepthFile(const std::string& path) {
  return readTextFile(path, "expected a depth image");
}

}  // namespace

std::vector<uint16_t> readDepthPng(const std::string& path, int width, int height) {
  const std::string bytes = readDepthFile(path), name = "'" + path + "'";
  PngReader png(bytes.data(), bytes.size());
  DepthImage image = readHeader(png, name);
  if (image.width != width || image.height != height) {
    throw std::runtime_error(name + " is " + inWords(image.width, image.height) +
                             " pixels, but the camera has " + inWords(width, height));
  }
  readPixels(png, name, image);
  return std::move(image.values);
}

DepthImage readDepthPngSize(const std::string& path) {
  const std::string bytes = readDepthFile(path);
  PngReader png(bytes.data(), bytes.size());
  return readHeader(png, "'" + path + "'");
}

DepthImage decodeDepthPng(const uint8_t* data, size_t bytes) {
  const std::string name = "the compressed image";
  PngReader png(data, bytes);
  DepthImage image = readHeader(png, name);
  readPixels(png, name, image);
  return image;
}

std::string encodeDepthPng(const DepthImage& image) {
  return pngBytes(image.width, image.height, PNG_FORMAT_LINEAR_Y, image.values.data());
}

namespace {

/// Decodes the difference between two pixels, modulo 2^16.
uint16_t decodeZigzag(uint32_t zigzag) {
  return static_cast<uint16_t>((zigzag >> 1) ^ (0u - (zigzag & 1u)));
}

}  // namespace

std::vector<uint16_t> decodeRvl(const uint8_t* data, size_t bytes, size_t pixels) {
  const size_t groups = 2 * (bytes / 4 * 4);
  size_t next_group = 0;
  const auto readNumber = [&] {
    uint32_t number = 0;
    for (int shift = 0; shift < 32; shift += 3) {
      if (next_group == groups) throw std::runtime_error("the RVL data are incomplete");
      // Words are little-endian: the last byte is the most significant.
      const size_t in_word = next_group % 8;
      const uint8_t byte = data[4 * (next_group / 8) + 3 - in_word / 2];
      const uint32_t group = in_word % 2 == 0 ? byte >> 4 : byte & 15u;
      ++next_group;
      number |= (group & 7u) << shift;
      if ((group & 8u) == 0) return number;
    }
    throw std::runtime_error("the RVL data contain a number of more than 32 bits");
  };
  const auto readRun = [&](size_t left) -> size_t {
    const uint32_t length = readNumber();
    if (length > left) throw std::runtime_error("a run in the RVL data exceeds the image");
    return length;
  };
  std::vector<uint16_t> image(pixels, 0);
  uint16_t value = 0;
  for (size_t next = 0; next < pixels;) {
    next += readRun(pixels - next);  // the image is initialised with zeros
    for (size_t left = readRun(pixels - next); left > 0; --left) {
      value = static_cast<uint16_t>(value + decodeZigzag(readNumber()));
      image[next++] = value;
    }
  }
  return image;
}

namespace {

const std::string kTransport = "compressedDepth";

/// The parts of a format such as "16UC1; compressedDepth png". Older publishers omit " png", or
/// everything after "16UC1".
struct Format {
  std::string encoding;
  std::string code;  ///< Empty, "png", "rvl" or unknown.
  bool is_depth = false;
  /// True for "16UC1; png compressed " from the transport `compressed`, whose data have no header.
  bool is_file = false;
};

Format parseFormat(const std::string& text) {
  Format format;
  const size_t semicolon = text.find(';');
  format.encoding = text.substr(0, semicolon);
  if (semicolon == std::string::npos) {
    format.is_depth = true;
    return format;
  }
  format.is_file = text.compare(semicolon, 16, "; png compressed") == 0;
  format.is_depth = format.is_file && format.encoding != "32FC1";
  const size_t transport = text.find(kTransport, semicolon);
  if (transport == std::string::npos) return format;
  format.is_depth = true;
  format.is_file = false;
  const std::string rest = text.substr(transport + kTransport.size());
  const size_t begin = rest.find_first_not_of(' ');
  if (begin != std::string::npos) format.code = rest.substr(begin, rest.find_first_of(" ;", begin));
  return format;
}

bool isRvl(const Format& format) {
  if (format.code.empty() || format.code == "png") return false;
  if (format.code == "rvl") return true;
  throw std::runtime_error("compressed depth in an unknown format, '" + printable(format.code) +
                           "'; only png and rvl are supported");
}

DepthImage decodeRvlImage(ByteReader& in) {
  const auto columns = in.take<uint32_t>(), rows = in.take<uint32_t>();
  if (columns == 0 || rows == 0 || columns > kMaxPixels || rows > kMaxPixels / columns) {
    throw std::runtime_error("compressed depth has " + std::to_string(columns) + " x " +
                             std::to_string(rows) + " pixels: it is empty or too large");
  }
  return {static_cast<int>(columns), static_cast<int>(rows),
          decodeRvl(in.takeBytes(0), in.left(), size_t{columns} * rows)};
}

template <class Pixel>
std::vector<uint8_t> bytesOf(const std::vector<Pixel>& pixels) {
  std::vector<uint8_t> bytes(pixels.size() * sizeof(Pixel));
  std::memcpy(bytes.data(), pixels.data(), bytes.size());
  return bytes;
}

/// Converts the transport's 16-bit values to depths in metres. A value is scale / depth + offset,
/// rounded down, or 0 if nothing was measured.
std::vector<float> depthsOfInverse(const std::vector<uint16_t>& inverse, float scale,
                                   float offset) {
  std::vector<float> depths_m;
  depths_m.reserve(inverse.size());
  for (const uint16_t value : inverse) {
    const float scaled = static_cast<float>(value) - offset;
    depths_m.push_back(value == 0 || scaled == 0.0f ? std::numeric_limits<float>::quiet_NaN()
                                                    : scale / scaled);
  }
  return depths_m;
}

}  // namespace

size_t maxImagePixels() { return kMaxPixels; }

std::string encodingOfCompressedDepth(const std::string& format) {
  const Format parsed = parseFormat(format);
  return parsed.is_depth ? parsed.encoding : "";
}

Raster<uint8_t> decodeCompressedDepth(const std::string& text, const std::vector<uint8_t>& data) {
  const Format format = parseFormat(text);
  if (!format.is_depth) {
    throw std::runtime_error("format '" + printable(text) + "' is not a compressed depth format");
  }
  const bool is_float = format.encoding == "32FC1";
  if (!is_float && format.encoding != "16UC1" && format.encoding != "mono16") {
    throw std::runtime_error("compressed depth with encoding '" + printable(format.encoding) +
                             "'; depth must be 16UC1 or 32FC1");
  }
  if (format.is_file) {
    const DepthImage image = decodeDepthPng(data.data(), data.size());
    return {image.width, image.height, bytesOf(image.values)};
  }
  const bool is_rvl = isRvl(format);
  constexpr size_t kHeaderBytes = 12, kRvlHeaderBytes = 20;
  if (data.size() < (is_rvl ? kRvlHeaderBytes : kHeaderBytes)) {
    throw std::runtime_error("compressed depth is shorter than its header");
  }
  ByteReader in(data);
  in.take<uint32_t>();  // the transport's format code, which is always the same number
  const auto scale = in.take<float>(), offset = in.take<float>();
  const DepthImage image = is_rvl ? decodeRvlImage(in) : decodeDepthPng(in.takeBytes(0), in.left());
  return {image.width, image.height,
          is_float ? bytesOf(depthsOfInverse(image.values, scale, offset)) : bytesOf(image.values)};
}

}  // namespace dtsdf
