/// Writes RVL by its description, for tests of the decoder.
#pragma once

#include <cstdint>
#include <vector>

namespace dtsdf {

class RvlEncoder {
 public:
  void writeNumber(uint32_t number) {
    do {
      const uint32_t more = number > 7 ? 8 : 0;
      groups_.push_back((number & 7) | more);
      number >>= 3;
    } while (number > 0);
  }

  /// Runs of zeros and of other values in turn.
  void writeImage(const std::vector<uint16_t>& pixels) {
    uint16_t before = 0;
    for (size_t next = 0; next < pixels.size();) {
      next += writeRun(pixels, next, true);
      for (size_t left = writeRun(pixels, next, false); left > 0; --left, ++next) {
        const int32_t difference = pixels[next] - before;
        writeNumber(static_cast<uint32_t>(difference < 0 ? -2 * difference - 1 : 2 * difference));
        before = pixels[next];
      }
    }
  }

  /// Words of 8 groups, the first highest, little-endian; the last one is filled up.
  std::vector<uint8_t> bytes() const {
    std::vector<uint8_t> result;
    for (size_t first = 0; first < groups_.size(); first += 8) {
      uint32_t word = 0;
      for (size_t i = 0; i < 8; ++i) {
        word = word << 4 | (first + i < groups_.size() ? groups_[first + i] : 0);
      }
      for (int byte = 0; byte < 4; ++byte) result.push_back(static_cast<uint8_t>(word >> 8 * byte));
    }
    return result;
  }

 private:
  size_t writeRun(const std::vector<uint16_t>& pixels, size_t begin, bool of_zeros) {
    size_t end = begin;
    while (end < pixels.size() && (pixels[end] == 0) == of_zeros) ++end;
    writeNumber(static_cast<uint32_t>(end - begin));
    return end - begin;
  }

  std::vector<uint32_t> groups_;
};

}  // namespace dtsdf
