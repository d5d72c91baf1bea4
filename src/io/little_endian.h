/// Numbers in files, which are little-endian: as they lie in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "io/atomic_file.h"
#include "kernels/core/vec.h"

namespace dtsdf {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "numbers lie in memory as in files");

/// The bytes of a number, the least first; floating-point ones as IEEE 754 has them.
template <class Number>
std::array<uint8_t, sizeof(Number)> littleEndianBytes(Number number) {
  static_assert(std::is_arithmetic_v<Number>);
  std::array<uint8_t, sizeof(Number)> bytes;
  std::memcpy(bytes.data(), &number, sizeof(number));
  return bytes;
}

/// And back. @pre There are as many bytes.
template <class Number>
Number numberOf(const uint8_t* bytes) {
  static_assert(std::is_arithmetic_v<Number>);
  Number number;
  std::memcpy(&number, bytes, sizeof(number));
  return number;
}

/// `File` has write(data, bytes).
template <class File>
class BasicLittleEndianWriter {
 public:
  explicit BasicLittleEndianWriter(File& file) : file_(file) {}

  void writeUint8(uint8_t value) { file_.write(&value, 1); }
  void writeUint16(uint16_t value) { write(value); }
  void writeUint32(uint32_t value) { write(value); }
  void writeFloat(float value) { write(value); }
  void writeDouble(double value) { write(value); }
  void writeVector(const Vec3f& v) {
    writeFloat(v.x);
    writeFloat(v.y);
    writeFloat(v.z);
  }

 private:
  template <class Number>
  void write(Number value) {
    file_.write(&value, sizeof(value));
  }

  File& file_;
};

using LittleEndianWriter = BasicLittleEndianWriter<AtomicFile>;

}  // namespace dtsdf
