/// RVL, a lossless code for 16-bit depth images.
///
/// After A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017: runs of zeros and of
/// other values in turn, each begun by its length; of the values, differences to the one before, in
/// zigzag (0, -1, 1, -2, ...). All numbers are groups of 4 bits: 3 of the number, lowest first, and
/// the highest to say that more follow. 8 groups make a 32-bit word, first group highest, and words
/// are little-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace dtsdf {

/// Decodes `pixels` values. @throws std::runtime_error if the data end early, or have a run that is
/// longer than what is left of the image.
std::vector<uint16_t> decodeRvl(const uint8_t* data, size_t bytes, size_t pixels);

/// The code of an image, which decodeRvl() decodes to the same values.
std::vector<uint8_t> encodeRvl(const uint16_t* pixels, size_t count);

}  // namespace dtsdf
