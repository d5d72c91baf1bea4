/// Corrects the checksums of PNG images, so that fuzzed images pass the first checks of a decoder.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <vector>

namespace dtsdf {

/// Returns the image with the checksum of each chunk corrected.
inline std::vector<uint8_t> withSums(std::vector<uint8_t> png) {
  size_t at = 8;
  while (png.size() >= at + 12) {
    size_t length = 0;
    for (int i = 0; i < 4; ++i) length = length << 8 | png[at + i];
    if (length > png.size() - at - 12) break;
    const uLong sum = crc32(0, &png[at + 4], static_cast<uInt>(length + 4));
    for (int i = 0; i < 4; ++i) {
      png[at + 8 + length + i] = static_cast<uint8_t>(sum >> (24 - 8 * i));
    }
    at += length + 12;
  }
  return png;
}

}  // namespace dtsdf
