/// Codes of depth images: PNG, RVL, and what image_transport's compressedDepth sends. By libpng
/// alone, so that the programs need no image library beyond, nor a plugin.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/raster.h"

namespace dtsdf {

/// The pixels of a depth image in a file, row by row.
/// @throws std::runtime_error that names the file, if it is missing, damaged, not 16-bit grey, or
/// not of the expected size.
std::vector<uint16_t> readDepthPng(const std::string& path, int width, int height);

/// A depth image in a file without its pixels, for its size.
/// @throws std::runtime_error that names the file, if it is missing, damaged or not 16-bit grey.
DepthImage readDepthPngSize(const std::string& path);

/// A depth image in memory. What its header announces is checked before memory is taken for it.
/// @throws std::runtime_error if it is damaged, not 16-bit grey, or larger than images may be.
DepthImage decodeDepthPng(const uint8_t* data, size_t bytes);

/// The bytes of a file. @throws std::runtime_error if libpng cannot make them.
std::string encodeDepthPng(const DepthImage& image);

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
// columns, rows and RVL. No plugin and no image library beside libpng is needed to read them.

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
