/// Numbers in files: in little-endian order, on any machine.
#pragma once

#include <cstdint>
#include <cstring>
#include <limits>

#include "io/atomic_file.h"
#include "kernels/core/vec.h"

namespace dtsdf {

/// `File` has write(data, bytes).
template <class File>
class BasicLittleEndianWriter {
 public:
  explicit BasicLittleEndianWriter(File& file) : file_(file) {}

  void writeUint8(uint8_t value) { file_.write(&value, 1); }
  void writeUint16(uint16_t value) { writeBytes<2>(value); }
  void writeUint32(uint32_t value) { writeBytes<4>(value); }
  void writeFloat(float value) {
    static_assert(sizeof(float) == sizeof(uint32_t) && std::numeric_limits<float>::is_iec559);
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    writeUint32(bits);
  }
  void writeDouble(double value) {
    static_assert(sizeof(double) == sizeof(uint64_t) && std::numeric_limits<double>::is_iec559);
    uint64_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    writeUint32(static_cast<uint32_t>(bits));
    writeUint32(static_cast<uint32_t>(bits >> 32));
  }
  void writeVector(const Vec3f& v) {
    writeFloat(v.x);
    writeFloat(v.y);
    writeFloat(v.z);
  }

 private:
  template <int kBytes>
  void writeBytes(uint32_t value) {
    uint8_t bytes[kBytes];
    for (int i = 0; i < kBytes; ++i) bytes[i] = static_cast<uint8_t>(value >> (8 * i));
    file_.write(bytes, kBytes);
  }

  File& file_;
};

using LittleEndianWriter = BasicLittleEndianWriter<AtomicFile>;

}  // namespace dtsdf
