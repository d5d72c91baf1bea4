// Fuzzes the readers for PNG depth images, from memory and from a file.
#include "io/depth_codes.h"

#include "fuzz/fuzz_input.h"
#include "fuzz/png_sums.h"

using namespace dtsdf;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::vector<uint8_t> png = withSums({data, data + size});
  expectAnswer([&] {
    const DepthImage image = decodeDepthPng(png.data(), png.size());
    require(image.values.size() == size_t(image.width) * image.height, "a value per pixel");
  });
  const InputFile file(png.data(), png.size());
  expectAnswer([&] {
    const DepthImage size = readDepthPngSize(file.path());
    readDepthPng(file.path(), size.width, size.height);
  });
  return 0;
}
