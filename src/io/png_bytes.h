/// PNG images made in memory.
#pragma once

#include <png.h>

#include <stdexcept>
#include <string>

namespace dtsdf {

/// The file of an image whose size and format stand in `png`. @throws std::runtime_error
inline std::string pngBytes(png_image& png, const void* pixels) {
  // Without a place for the bytes it returns how many there are.
  const auto write = [&](void* bytes, png_alloc_size_t size) {
    if (png_image_write_to_memory(&png, bytes, &size, 0, pixels, 0, nullptr) == 0) {
      throw std::runtime_error(std::string("cannot make a PNG image: ") + png.message);
    }
    return size;
  };
  std::string bytes(write(nullptr, 0), '\0');
  write(&bytes[0], bytes.size());
  return bytes;
}

}  // namespace dtsdf
