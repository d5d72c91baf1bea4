/// Codes of depth images in messages: RVL, and what image_transport's compressedDepth sends. No
/// plugin is needed to read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/raster.h"

namespace dtsdf {

// RVL, a lossless code for 16-bit depth images.
//
// After A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017: runs of zeros and of
// other values in turn, each begun by its length; of the values, differences to the one before, in
// zigzag (0, -1, 1, -2, ...). All numbers are groups of 4 bits: 3 of the number, lowest first, and
// the highest to say that more follow. 8 groups make a 32-bit word, first group highest, and words
// are little-endian.

/// Decodes `pixels` values. @throws std::runtime_error if the data end early, or have a run that is
/// longer than what is left of the image.
std::vector<uint16_t> decodeRvl(const uint8_t* data, size_t bytes, size_t pixels);

// Depth images as image_transport's compressedDepth sends them: 12 bytes of header, then PNG, or
// columns, rows and RVL.

/// The encoding that a message's format announces ("16UC1; compressedDepth png": "16UC1"), of any
/// kind, or that of a 16-bit PNG ("16UC1; png compressed "); empty if it is none of these.
std::string encodingOfCompressedDepth(const std::string& format);

/// Pixels of the largest image that a map takes, of depth or of colour.
size_t mostImagePixels();

/// Decodes a message: 16-bit depth exactly, 32-bit depth from the inverse depths that the transport
/// rounds it to. Memory is taken for kMaxPixels at most.
/// @return its bytes, in the machine's order, of the encoding that encodingOfCompressedDepth() has.
/// @throws std::runtime_error that says what is wrong with the message.
Raster<uint8_t> decodeCompressedDepth(const std::string& format, const std::vector<uint8_t>& data);

}  // namespace dtsdf
