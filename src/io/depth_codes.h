/// Codecs for depth images: PNG, RVL and image_transport's compressedDepth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/raster.h"

namespace dtsdf {

/// Reads the pixels of a depth image file, in row-major order.
/// @throws std::runtime_error that names the file, if it is missing, damaged, not 16-bit greyscale,
/// or not of the expected size.
std::vector<uint16_t> readDepthPng(const std::string& path, int width, int height);

/// Reads the size of a depth image file from its header. Does not detect damaged pixel data.
/// @throws std::runtime_error that names the file, if it is missing, not a 16-bit greyscale PNG, or
/// too large.
DepthImage readDepthPngSize(const std::string& path);

/// Decodes a PNG in memory. Checks the size in its header before allocating memory for pixels.
/// @throws std::runtime_error if it is damaged, not 16-bit greyscale, or too large.
DepthImage decodeDepthPng(const uint8_t* data, size_t bytes);

/// Encodes an image as a PNG file in memory. @throws std::runtime_error if libpng fails.
std::string encodeDepthPng(const DepthImage& image);

// RVL, a lossless compression format for 16-bit depth images.
//
// A. D. Wilson, "Fast Lossless Depth Image Compression", ISS 2017: runs of zeros alternate with
// runs of other values, and each run begins with its length. A value is stored as its difference
// from the previous one, in zigzag order (0, -1, 1, -2, ...). Numbers are written in groups of 4
// bits: 3 bits of the number, least significant bits first, and a top bit that is set if more
// groups follow. Eight groups form a little-endian 32-bit word, with the first group in the most
// significant bits.

/// Decodes `pixels` values. @throws std::runtime_error if the data end early, a run exceeds the
/// image, or a number has more than 32 bits.
std::vector<uint16_t> decodeRvl(const uint8_t* data, size_t bytes, size_t pixels);

// image_transport's compressedDepth: a 12-byte header, followed by either a PNG, or the image's
// width, its height and RVL data.

/// The encoding named in a message's `format` field: the text before the semicolon in formats such
/// as "16UC1; compressedDepth png" and "16UC1; png compressed ", or the whole text if it has no
/// semicolon. Empty for other formats, including "32FC1; png compressed ".
std::string encodingOfCompressedDepth(const std::string& format);

/// Largest number of pixels that a depth or colour image may have.
size_t maxImagePixels();

/// Decodes a message. 16-bit depth is exact; 32-bit depth has been rounded by the transport.
/// Allocates memory for at most maxImagePixels() pixels.
/// @return the pixels in native byte order, with the encoding that encodingOfCompressedDepth()
/// returns.
/// @throws std::runtime_error that says what is wrong with the message.
Raster<uint8_t> decodeCompressedDepth(const std::string& format, const std::vector<uint8_t>& data);

}  // namespace dtsdf
