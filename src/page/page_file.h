/// A file without a name in a folder: nobody else opens it, and however the process ends, the
/// system takes its space back. So there is nothing to lock, and nothing is left behind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "dtsdf_mapping/map_contents.h"

namespace dtsdf {

/// What is written to a page file, and read from it.
using PageBytes = PlainArray<char>;

/// What became of what lies on disk.
struct PagedStats {
  size_t bytes = 0;        ///< Of the disk.
  size_t index_bytes = 0;  ///< Of memory, that it takes to know of it, about.
  uint64_t failures = 0;   ///< Reads and writes that failed, or found the folder full.
  uint64_t lost = 0;       ///< Of these things, those that did not come back as they were.
  std::string problem;     ///< What the last failure was; empty: there was none.
};

class PageFile {
 public:
  /// Makes the folder where it is missing.
  /// @throws std::runtime_error where no file can be made there.
  explicit PageFile(const std::string& folder);
  ~PageFile();
  PageFile(const PageFile&) = delete;
  PageFile& operator=(const PageFile&) = delete;

  /// @return what went wrong; empty: everything is written, or read.
  std::string write(uint64_t offset, const char* bytes, size_t size);
  /// @param is_short Set where the file has not so much: it will not come with another try.
  std::string read(uint64_t offset, char* bytes, size_t size, bool& is_short) const;

  /// Gives the space beyond back to the disk, as far as it can.
  void truncate(uint64_t size);

 private:
  std::string folder_;
  int file_ = -1;
};

}  // namespace dtsdf
