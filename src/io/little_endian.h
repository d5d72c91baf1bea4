/// Numbers in files: in little-endian order, on any machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "io/atomic_file.h"
#include "kernels/core/vec.h"

namespace dtsdf {

inline bool hostIsLittleEndian() {
  const uint16_t probe = 1;
  return *reinterpret_cast<const uint8_t*>(&probe) == 1;
}

/// The bytes of a number, the least first; floating-point ones as IEEE 754 has them.
template <class Number>
std::array<uint8_t, sizeof(Number)> littleEndianBytes(Number number) {
  static_assert(std::is_integral_v<Number> || std::numeric_limits<Number>::is_iec559);
  uint64_t bits = 0;
  if constexpr (std::is_integral_v<Number>) {
    bits = static_cast<uint64_t>(number);
  } else if constexpr (sizeof(Number) == sizeof(uint32_t)) {
    uint32_t word;
    std::memcpy(&word, &number, sizeof(word));
    bits = word;
  } else {
    std::memcpy(&bits, &number, sizeof(bits));
  }
  std::array<uint8_t, sizeof(Number)> bytes;
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<uint8_t>(bits >> (8 * i));
  return bytes;
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
    const auto bytes = littleEndianBytes(value);
    file_.write(bytes.data(), bytes.size());
  }

  File& file_;
};

using LittleEndianWriter = BasicLittleEndianWriter<AtomicFile>;

}  // namespace dtsdf
