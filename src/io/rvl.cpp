#include "io/rvl.h"

#include <stdexcept>

namespace dtsdf {
namespace {

/// Numbers of a stream of groups.
class GroupReader {
 public:
  GroupReader(const uint8_t* data, size_t bytes) : data_(data), groups_(2 * (bytes / 4 * 4)) {}

  uint32_t readNumber() {
    uint32_t number = 0;
    for (int shift = 0; shift < kBits; shift += 3) {
      const uint32_t group = readGroup();
      number |= (group & 7u) << shift;
      if ((group & 8u) == 0) return number;
    }
    throw std::runtime_error("the RVL data contain a number of more than 32 bits");
  }

 private:
  static constexpr int kBits = 32;

  uint32_t readGroup() {
    if (next_ == groups_) throw std::runtime_error("the RVL data end before the image does");
    const size_t word = next_ / 8, in_word = next_ % 8;
    ++next_;
    // The highest byte of a little-endian word is its last one.
    const uint8_t byte = data_[4 * word + 3 - in_word / 2];
    return in_word % 2 == 0 ? byte >> 4 : byte & 15u;
  }

  const uint8_t* data_;
  size_t groups_, next_ = 0;
};

/// The difference that a zigzag number stands for, modulo 2^16, as the pixels are.
uint16_t unfold(uint32_t zigzag) {
  return static_cast<uint16_t>((zigzag >> 1) ^ (0u - (zigzag & 1u)));
}

size_t readRun(GroupReader& groups, size_t left) {
  const uint32_t length = groups.readNumber();
  if (length > left) throw std::runtime_error("the RVL data have a run that exceeds the image");
  return length;
}

}  // namespace

std::vector<uint16_t> decodeRvl(const uint8_t* data, size_t bytes, size_t pixels) {
  std::vector<uint16_t> image(pixels, 0);
  GroupReader groups(data, bytes);
  uint16_t value = 0;
  for (size_t next = 0; next < pixels;) {
    next += readRun(groups, pixels - next);  // zeros, which the image holds from the start
    for (size_t left = readRun(groups, pixels - next); left > 0; --left) {
      value = static_cast<uint16_t>(value + unfold(groups.readNumber()));
      image[next++] = value;
    }
  }
  return image;
}

}  // namespace dtsdf
