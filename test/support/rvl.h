/// RVL encoder for testing the decoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace dtsdf {

/// Packs 4-bit groups into 32-bit words.
class RvlWriter {
 public:
  explicit RvlWriter(size_t bytes) { bytes_.reserve(bytes); }

  void writeNumber(uint32_t number) {
    for (; number > 7; number >>= 3) writeGroup((number & 7u) | 8u);
    writeGroup(number);
  }

  std::vector<uint8_t> finish() {
    while (groups_ != 0) writeGroup(0);
    return std::move(bytes_);
  }

 private:
  void writeGroup(uint32_t group) {
    word_ = word_ << 4 | group;
    if (++groups_ < 8) return;
    for (int shift = 0; shift < 32; shift += 8) {
      bytes_.push_back(static_cast<uint8_t>(word_ >> shift));
    }
    word_ = 0;
    groups_ = 0;
  }

  std::vector<uint8_t> bytes_;
  uint32_t word_ = 0;
  int groups_ = 0;
};

/// Encodes an image that decodeRvl() can decode.
inline std::vector<uint8_t> encodeRvl(const uint16_t* pixels, size_t count) {
  RvlWriter groups(2 * count + 64);
  int32_t before = 0;
  for (size_t next = 0; next < count;) {
    const size_t zeros = next;
    while (next < count && pixels[next] == 0) ++next;
    groups.writeNumber(static_cast<uint32_t>(next - zeros));
    const size_t begin = next;
    size_t end = next;
    while (end < count && pixels[end] != 0) ++end;
    groups.writeNumber(static_cast<uint32_t>(end - begin));
    for (; next < end; ++next) {
      const int32_t difference = pixels[next] - before;
      groups.writeNumber(
          static_cast<uint32_t>(difference < 0 ? -2 * difference - 1 : 2 * difference));
      before = pixels[next];
    }
  }
  return groups.finish();
}

}  // namespace dtsdf
