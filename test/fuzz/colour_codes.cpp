// Fuzzes the decoders for colour images in PNG and JPEG format.
#include "io/colour_codes.h"

#include "fuzz/fuzz_input.h"
#include "fuzz/png_sums.h"

using namespace dtsdf;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::vector<uint8_t> bytes(data, data + size);
  if (size > 8 && data[0] == 0x89) bytes = withSums(std::move(bytes));
  expectAnswer([&] {
    const RgbImage image = decodeColour(bytes.data(), bytes.size(), "the image");
    require(image.values.size() == 3 * size_t(image.width) * image.height, "a value per channel");
  });
  return 0;
}
