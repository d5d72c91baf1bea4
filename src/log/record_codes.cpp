#include "log/record_codes.h"

#include <zstd.h>

#include <cstring>
#include <stdexcept>

#include "io/depth_codes.h"

namespace dtsdf {
namespace {

/// Fast: a thread codes many images a second, beside a mapper that needs the cores.
constexpr int kLevel = 1;
/// RVL takes six groups of 4 bits a pixel at worst, and two that begin its run.
constexpr size_t kMostRvlBytesPerPixel = 4;

std::string compress(const void* bytes, size_t count) {
  std::string code(ZSTD_compressBound(count), '\0');
  const size_t size = ZSTD_compress(code.data(), code.size(), bytes, count, kLevel);
  if (ZSTD_isError(size)) {
    throw std::runtime_error(std::string("cannot compress: ") + ZSTD_getErrorName(size));
  }
  code.resize(size);
  return code;
}

/// @return how many bytes there were, at most `room`.
size_t decompress(const std::string& code, void* bytes, size_t room) {
  const size_t size = ZSTD_decompress(bytes, room, code.data(), code.size());
  if (ZSTD_isError(size)) {
    throw std::runtime_error(std::string("an image cannot be decompressed: ") +
                             ZSTD_getErrorName(size));
  }
  return size;
}

void decompressAll(const std::string& code, void* bytes, size_t count) {
  if (decompress(code, bytes, count) == count) return;
  throw std::runtime_error("an image has fewer bytes than its size requires");
}

}  // namespace

std::string packDepth16(const uint16_t* pixels, size_t count) {
  const std::vector<uint8_t> runs = encodeRvl(pixels, count);
  return compress(runs.data(), runs.size());
}

std::vector<uint16_t> unpackDepth16(const std::string& code, size_t count) {
  std::vector<uint8_t> runs(kMostRvlBytesPerPixel * count + 64);
  runs.resize(decompress(code, runs.data(), runs.size()));
  return decodeRvl(runs.data(), runs.size(), count);
}

std::string packFloats(const float* values, size_t count) {
  std::vector<uint8_t> planes(4 * count);
  uint32_t before = 0;
  for (size_t i = 0; i < count; ++i) {
    uint32_t bits;
    std::memcpy(&bits, values + i, sizeof(bits));
    const uint32_t difference = bits - before;
    before = bits;
    for (size_t plane = 0; plane < 4; ++plane) {
      planes[plane * count + i] = static_cast<uint8_t>(difference >> (8 * plane));
    }
  }
  return compress(planes.data(), planes.size());
}

std::vector<float> unpackFloats(const std::string& code, size_t count) {
  std::vector<uint8_t> planes(4 * count);
  decompressAll(code, planes.data(), planes.size());
  std::vector<float> values(count);
  uint32_t bits = 0;
  for (size_t i = 0; i < count; ++i) {
    for (size_t plane = 0; plane < 4; ++plane) {
      bits += uint32_t{planes[plane * count + i]} << (8 * plane);
    }
    std::memcpy(&values[i], &bits, sizeof(bits));
  }
  return values;
}

std::string packColours(const uint8_t* bytes, size_t count, size_t pixel_bytes) {
  std::vector<uint8_t> differences(bytes, bytes + count);
  for (size_t i = pixel_bytes; i < count; ++i) {
    differences[i] = static_cast<uint8_t>(bytes[i] - bytes[i - pixel_bytes]);
  }
  return compress(differences.data(), differences.size());
}

std::vector<uint8_t> unpackColours(const std::string& code, size_t count, size_t pixel_bytes) {
  std::vector<uint8_t> bytes(count);
  decompressAll(code, bytes.data(), count);
  for (size_t i = pixel_bytes; i < count; ++i) {
    bytes[i] = static_cast<uint8_t>(bytes[i] + bytes[i - pixel_bytes]);
  }
  return bytes;
}

}  // namespace dtsdf
