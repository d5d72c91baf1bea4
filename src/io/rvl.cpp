#include "io/rvl.h"

#include <stdexcept>
#include <utility>

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

/// Groups of a stream, into words.
class GroupWriter {
 public:
  explicit GroupWriter(size_t bytes) { bytes_.reserve(bytes); }

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

/// The zigzag number of a difference.
uint32_t fold(int32_t difference) {
  return static_cast<uint32_t>(difference < 0 ? -2 * difference - 1 : 2 * difference);
}

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

std::vector<uint8_t> encodeRvl(const uint16_t* pixels, size_t count) {
  GroupWriter groups(2 * count + 64);
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
      groups.writeNumber(fold(pixels[next] - before));
      before = pixels[next];
    }
  }
  return groups.finish();
}

}  // namespace dtsdf
