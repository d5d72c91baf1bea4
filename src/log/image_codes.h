/// Images without loss, in few bytes and little time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace dtsdf {

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
