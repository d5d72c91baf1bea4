/// The order of bytes in the machine's numbers.
#pragma once

#include <cstdint>

namespace dtsdf {

inline bool hostIsLittleEndian() {
  const uint16_t probe = 1;
  return *reinterpret_cast<const uint8_t*>(&probe) == 1;
}

}  // namespace dtsdf
