// Fuzzes the decoder for image_transport's compressedDepth format: a header, then PNG or RVL. The
// first byte selects the format.
#include "io/depth_codes.h"

#include "fuzz/fuzz_input.h"
#include "fuzz/png_sums.h"

using namespace dtsdf;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const char* const formats[] = {"16UC1; compressedDepth rvl",
                                 "16UC1; compressedDepth png",
                                 "32FC1; compressedDepth rvl",
                                 "32FC1; compressedDepth png",
                                 "16UC1",
                                 "mono16; compressedDepth",
                                 ""};
  const size_t known = sizeof(formats) / sizeof(formats[0]);
  // The last choice uses the input itself as the format string.
  const std::string format = data[0] % (known + 1) == known ? std::string(data + 1, data + size)
                                                            : formats[data[0] % (known + 1)];
  constexpr size_t kHeader = 12;
  std::vector<uint8_t> message(data + 1, data + size);
  if (message.size() > kHeader && format.find("png") != std::string::npos) {
    const std::vector<uint8_t> png = withSums({message.begin() + kHeader, message.end()});
    std::copy(png.begin(), png.end(), message.begin() + kHeader);
  }
  expectAnswer([&] {
    const bool is_float = encodingOfCompressedDepth(format) == "32FC1";
    const Raster<uint8_t> depth = decodeCompressedDepth(format, message);
    const size_t bytes = is_float ? 4 : 2;
    require(depth.values.size() == bytes * depth.width * depth.height, "a value per pixel");
  });
  return 0;
}
