/// Shared by the fuzz targets: reads the input as a file or as numbers, and checks for expected
/// errors.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

namespace dtsdf {

/// Invalid input must cause a runtime_error with a message. Any other exception, such as bad_alloc
/// or out_of_range, escapes from the target and is a finding.
template <class Read>
void expectAnswer(const Read& read) {
  try {
    read();
  } catch (const std::runtime_error& error) {
    if (*error.what() == '\0') std::abort();
  }
}

/// Aborts the program if an invariant does not hold.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "expected: %s\n", what);
  std::abort();
}

/// An in-memory file with the given bytes.
class InputFile {
 public:
  InputFile(const uint8_t* data, size_t size) : descriptor_(memfd_create("input", MFD_CLOEXEC)) {
    require(descriptor_ >= 0, "memfd_create() succeeds");
    require(write(descriptor_, data, size) == static_cast<ssize_t>(size), "all bytes are written");
  }
  ~InputFile() { close(descriptor_); }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/// Reads numbers from a sequence of bytes; past its end, all bytes read as zero.
class InputBytes {
 public:
  InputBytes(const uint8_t* data, size_t size) : data_(data), left_(size) {}

  template <class Number>
  Number take() {
    Number number{};
    const size_t bytes = left_ < sizeof(number) ? left_ : sizeof(number);
    if (bytes > 0) std::memcpy(&number, data_, bytes);
    data_ += bytes;
    left_ -= bytes;
    return number;
  }

  /// A number from 0 to count - 1.
  int choose(int count) { return take<uint8_t>() % count; }
  size_t left() const { return left_; }

 private:
  const uint8_t* data_;
  size_t left_;
};

}  // namespace dtsdf

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);
