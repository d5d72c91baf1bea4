#include "io/depth_codes.h"

#include <gtest/gtest.h>

#include "support/rvl.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

using Pixels = std::vector<uint16_t>;

Pixels decode(const std::vector<uint8_t>& bytes, size_t pixels) {
  return decodeRvl(bytes.data(), bytes.size(), pixels);
}

Pixels encodedAndDecoded(const Pixels& pixels) {
  return decode(encodeRvl(pixels.data(), pixels.size()), pixels.size());
}

// Encoded by hand: 2 zeros, 3 non-zeros, 1 zero, 0 non-zeros. The non-zeros differ from their
// predecessors by +5, -1 and +1. These differences are encoded as 10 (nibbles a and 1), 1 and 2.
// Together, the nibbles 2 3 a 1 1 2 1 0 form the word 0x23a11210.
TEST(Rvl, DecodesAnExampleEncodedByHand) {
  EXPECT_EQ(decode({0x10, 0x12, 0xa1, 0x23}, 6), (Pixels{0, 0, 5, 4, 5, 0}));
}

TEST(Rvl, RestoresEveryPixelValue) {
  Pixels pixels;
  for (int i = 0; i < 65536; ++i) pixels.push_back(static_cast<uint16_t>(i));
  for (uint32_t i = 0; i < 65536; ++i) pixels.push_back(static_cast<uint16_t>(40503u * i));
  EXPECT_EQ(encodedAndDecoded(pixels), pixels);
  EXPECT_EQ(encodedAndDecoded(Pixels(307200, 0)), Pixels(307200, 0));
  EXPECT_EQ(encodedAndDecoded(Pixels(7, 65535)), Pixels(7, 65535));
}

TEST(Rvl, ReportsInvalidData) {
  const std::pair<std::vector<uint8_t>, std::string> cases[] = {
      {{0, 0, 0, 0x50}, "exceeds the image"},       // five zeros
      {{0, 0, 0, 0x14}, "exceeds the image"},       // a zero, four non-zeros
      {std::vector<uint8_t>(52, 0), "incomplete"},  // empty runs only
      {std::vector<uint8_t>(16, 0xff), "32 bits"}, {{}, "incomplete"},
      {{0x10, 0x12, 0xa1}, "incomplete"}};
  for (const auto& [bytes, reason] : cases) {
    const std::string error = errorOf([&, b = bytes] { decode(b, 4); });
    EXPECT_NE(error.find(reason), std::string::npos) << error;
  }
}

}  // namespace
}  // namespace dtsdf
