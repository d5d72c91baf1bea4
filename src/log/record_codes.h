/// Bytes of the frame log: the numbers, poses and texts of a record's description, and images
/// without loss, in few bytes and little time.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/map_format.h"

namespace dtsdf {

inline ByteWriter& putString(ByteWriter& out, const std::string& text) {
  return out.put(static_cast<uint32_t>(text.size())).putText(text);
}

/// Takes what a description holds. Everything throws std::runtime_error where the bytes end early.
class DescriptionReader {
 public:
  explicit DescriptionReader(const std::string& bytes)
      : in_(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()), left_(bytes.size()) {}

  template <class Number>
  Number take() {
    need(sizeof(Number));
    return in_.take<Number>();
  }
  Eigen::Vector3d takeVector() {
    const auto x = take<double>(), y = take<double>(), z = take<double>();
    return {x, y, z};
  }
  Eigen::Isometry3d takePose() {
    need(kPoseBytes);
    return in_.takePose();
  }
  std::string takeText() {
    const auto length = take<uint32_t>();
    need(length);
    std::string text(length, '\0');
    for (char& c : text) c = static_cast<char>(in_.take<uint8_t>());
    return text;
  }
  void finish() const {
    if (left_ > 0) throwMalformed();
  }
  [[noreturn]] static void throwMalformed() {
    throw std::runtime_error("a record of the frame log is malformed");
  }

 private:
  void need(size_t bytes) {
    if (bytes > left_) throwMalformed();
    left_ -= bytes;
  }

  ByteReader in_;
  size_t left_;
};

/// 16-bit depth, as RVL and then zstd.
std::string packDepth16(const uint16_t* pixels, size_t count);
/// @throws std::runtime_error if the bytes are not such a code of so many pixels.
std::vector<uint16_t> unpackDepth16(const std::string& code, size_t count);

/// Depth in floating point, bit for bit: differences of their bits, byte by byte, by zstd.
std::string packFloats(const float* values, size_t count);
/// @throws std::runtime_error as above.
std::vector<float> unpackFloats(const std::string& code, size_t count);

/// Colours: differences of bytes that lie `pixel_bytes` apart, by zstd.
std::string packColours(const uint8_t* bytes, size_t count, size_t pixel_bytes);
/// @throws std::runtime_error as above.
std::vector<uint8_t> unpackColours(const std::string& code, size_t count, size_t pixel_bytes);

}  // namespace dtsdf
