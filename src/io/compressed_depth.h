/// Depth images as image_transport's compressedDepth sends them: 12 bytes of header, then PNG, or
/// columns, rows and RVL. No plugin and no image library beside libpng is needed to read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "io/depth_png.h"

namespace dtsdf {

struct DecodedDepth {
  std::string encoding;  ///< "16UC1", "mono16" or "32FC1".
  ImageSize size;
  std::vector<uint8_t> pixels;  ///< In the machine's byte order, rows without padding.
};

/// The encoding that a message's format announces ("16UC1; compressedDepth png": "16UC1"), of any
/// kind; empty if it is no format of compressedDepth.
std::string encodingOfCompressedDepth(const std::string& format);

/// Pixels of the largest image that a map takes, of depth or of colour.
size_t mostImagePixels();

/// Decodes a message: 16-bit depth exactly, 32-bit depth from the inverse depths that the transport
/// rounds it to. Memory is taken for kMaxPixels at most.
/// @throws std::runtime_error that says what is wrong with the message.
DecodedDepth decodeCompressedDepth(const std::string& format, const std::vector<uint8_t>& data);

}  // namespace dtsdf
