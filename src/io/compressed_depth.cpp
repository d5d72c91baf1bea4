#include "io/compressed_depth.h"

#include <cstring>
#include <limits>
#include <stdexcept>

#include "io/rvl.h"
#include "kernels/core/voxel.h"
#include "params/printable.h"

namespace dtsdf {
namespace {

const std::string kTransport = "compressedDepth";

enum class Code { kPng, kRvl };

/// "16UC1; compressedDepth png". Older senders leave out " png", or all that follows the encoding.
struct Format {
  std::string encoding;
  std::string code;  ///< Empty, "png" or "rvl", or what nobody knows.
  bool is_depth = false;
};

Format parseFormat(const std::string& text) {
  Format format;
  const size_t semicolon = text.find(';');
  format.encoding = text.substr(0, semicolon);
  if (semicolon == std::string::npos) {
    format.is_depth = true;
    return format;
  }
  const size_t transport = text.find(kTransport, semicolon);
  if (transport == std::string::npos) return format;
  format.is_depth = true;
  const std::string rest = text.substr(transport + kTransport.size());
  const size_t begin = rest.find_first_not_of(' ');
  if (begin != std::string::npos) format.code = rest.substr(begin, rest.find_first_of(" ;", begin));
  return format;
}

Code codeOf(const Format& format) {
  if (format.code.empty() || format.code == "png") return Code::kPng;
  if (format.code == "rvl") return Code::kRvl;
  throw std::runtime_error("compressed depth in an unknown format, '" + printable(format.code) +
                           "'; only png and rvl are supported");
}

/// Takes little-endian numbers from the front of a message.
class Header {
 public:
  explicit Header(const std::vector<uint8_t>& data) : data_(data) {}

  uint32_t readNumber() {
    if (data_.size() - at_ < 4) throw std::runtime_error("compressed depth without its header");
    uint32_t number = 0;
    for (size_t i = 0; i < 4; ++i) number |= static_cast<uint32_t>(data_[at_ + i]) << (8 * i);
    at_ += 4;
    return number;
  }

  float readFloat() {
    const uint32_t bits = readNumber();
    float number = 0.0f;
    std::memcpy(&number, &bits, sizeof(number));
    return number;
  }

  const uint8_t* rest() const { return data_.data() + at_; }
  size_t bytesLeft() const { return data_.size() - at_; }

 private:
  const std::vector<uint8_t>& data_;
  size_t at_ = 0;
};

DepthImage decodeRvlImage(Header& header) {
  const uint32_t columns = header.readNumber(), rows = header.readNumber();
  if (columns == 0 || rows == 0 || columns > kMaxPixels || rows > kMaxPixels / columns) {
    throw std::runtime_error("compressed depth of " + std::to_string(columns) + " x " +
                             std::to_string(rows) + " pixels");
  }
  return {{static_cast<int>(columns), static_cast<int>(rows)},
          decodeRvl(header.rest(), header.bytesLeft(), size_t{columns} * rows)};
}

template <class Pixel>
std::vector<uint8_t> bytesOf(const std::vector<Pixel>& pixels) {
  std::vector<uint8_t> bytes(pixels.size() * sizeof(Pixel));
  std::memcpy(bytes.data(), pixels.data(), bytes.size());
  return bytes;
}

/// The transport sends scale / depth + offset, rounded down, and 0 where nothing is measured.
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

size_t mostImagePixels() { return kMaxPixels; }

std::string encodingOfCompressedDepth(const std::string& format) {
  const Format parsed = parseFormat(format);
  return parsed.is_depth ? parsed.encoding : "";
}

DecodedDepth decodeCompressedDepth(const std::string& text, const std::vector<uint8_t>& data) {
  const Format format = parseFormat(text);
  if (!format.is_depth) {
    throw std::runtime_error("format '" + printable(text) +
                             "' is not a format of compressed "
                             "depth");
  }
  const bool is_float = format.encoding == "32FC1";
  if (!is_float && format.encoding != "16UC1" && format.encoding != "mono16") {
    throw std::runtime_error("compressed depth of encoding '" + printable(format.encoding) +
                             "'; depth must be 16UC1 or 32FC1");
  }
  const Code code = codeOf(format);
  Header header(data);
  header.readNumber();  // a code of the transport's own, the same for all
  const float scale = header.readFloat(), offset = header.readFloat();
  const DepthImage image = code == Code::kRvl ? decodeRvlImage(header)
                                              : decodeDepthPng(header.rest(), header.bytesLeft());
  return {format.encoding, image.size,
          is_float ? bytesOf(depthsOfInverse(image.pixels, scale, offset)) : bytesOf(image.pixels)};
}

}  // namespace dtsdf
