/// Reads and writes little-endian numbers; requires a little-endian machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "kernels/core/vec.h"

namespace dtsdf {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "big-endian machines are not supported: files are little-endian");

/// The bytes of a number, least significant first; floating-point numbers are IEEE 754.
template <class Number>
std::array<uint8_t, sizeof(Number)> littleEndianBytes(Number number) {
  static_assert(std::is_arithmetic_v<Number>);
  std::array<uint8_t, sizeof(Number)> bytes;
  std::memcpy(bytes.data(), &number, sizeof(number));
  return bytes;
}

/// The number stored in `bytes`. @pre There are at least sizeof(Number) bytes.
template <class Number>
Number numberOf(const uint8_t* bytes) {
  static_assert(std::is_arithmetic_v<Number>);
  Number number;
  std::memcpy(&number, bytes, sizeof(number));
  return number;
}

/// Writes a number, or the three components of a vector. `File` has write(data, bytes).
template <class File, class Number>
void put(File& file, Number number) {
  static_assert(std::is_arithmetic_v<Number>);
  file.write(reinterpret_cast<const char*>(&number), sizeof(number));
}
template <class File>
void put(File& file, const Vec3f& v) {
  put(file, v.x);
  put(file, v.y);
  put(file, v.z);
}

}  // namespace dtsdf
