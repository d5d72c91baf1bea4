#include "io/depth_codes.h"

#include <gtest/gtest.h>

#include "support/rvl_encoder.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

using Pixels = std::vector<uint16_t>;

Pixels decode(const std::vector<uint8_t>& bytes, size_t pixels) {
  return decodeRvl(bytes.data(), bytes.size(), pixels);
}

Pixels throughTheCode(const Pixels& pixels) {
  RvlEncoder encoder;
  encoder.writeImage(pixels);
  return decode(encoder.bytes(), pixels.size());
}

// By hand: 2 zeros; 3 others with the differences +5, -1, +1, that is 10 (in groups a and 1), 1 and
// 2; 1 zero; 0 others. Groups 2 3 a1 1 2 1 0 are the word 0x23a11210.
TEST(Rvl, IsAsDescribed) {
  EXPECT_EQ(decode({0x10, 0x12, 0xa1, 0x23}, 6), (Pixels{0, 0, 5, 4, 5, 0}));
}

TEST(Rvl, HoldsEveryPixelValue) {
  Pixels pixels;
  for (int i = 0; i < 65536; ++i) pixels.push_back(static_cast<uint16_t>(i));
  for (uint32_t i = 0; i < 65536; ++i) pixels.push_back(static_cast<uint16_t>(40503u * i));
  EXPECT_EQ(throughTheCode(pixels), pixels);
  EXPECT_EQ(throughTheCode(Pixels(307200, 0)), Pixels(307200, 0));
  EXPECT_EQ(throughTheCode(Pixels(7, 65535)), Pixels(7, 65535));
}

TEST(Rvl, TellsWhatIsWrong) {
  const auto errorFor = [](const RvlEncoder& encoder) {
    return errorOf([&] { decode(encoder.bytes(), 4); });
  };
  RvlEncoder zeros, others, endless;
  zeros.writeNumber(5);
  EXPECT_NE(errorFor(zeros).find("exceeds the image"), std::string::npos);
  others.writeNumber(1);
  others.writeNumber(4);
  EXPECT_NE(errorFor(others).find("exceeds the image"), std::string::npos);
  for (int i = 0; i < 100; ++i) endless.writeNumber(0);  // nothing, again and again
  EXPECT_NE(errorFor(endless).find("end before"), std::string::npos);
  EXPECT_NE(errorOf([&] { decode(std::vector<uint8_t>(16, 0xff), 4); }).find("32 bits"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { decode({}, 4); }).find("end before"), std::string::npos);
  EXPECT_NE(errorOf([&] { decode({0x10, 0x12, 0xa1}, 6); }).find("end before"), std::string::npos);
}

}  // namespace
}  // namespace dtsdf
