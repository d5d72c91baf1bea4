/// Writes a file completely or not at all: if writing fails, the existing file remains unchanged.
#pragma once

#include <cstddef>
#include <string>

namespace dtsdf {

/// Checks the name, folder and permissions of a file to be written. Call it before a long
/// computation. Creates missing folders; rejects an existing target that is not a regular file.
/// @throws std::runtime_error that names the path and says what to do.
void prepareOutputFile(const std::string& path);

/// Writes to a hidden file next to the target; commit() renames it into place. Without commit(),
/// the destructor removes the hidden file. Every error is a std::runtime_error that names the path
/// and says what to do.
class AtomicFile {
 public:
  /// Creates missing folders and opens the hidden file.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, size_t bytes);
  void write(const std::string& text) { write(text.data(), text.size()); }

  /// Syncs the file to disk and renames it to its final name.
  void commit();

 private:
  void flush();
  void closeAndRemove() noexcept;
  [[noreturn]] void fail(int error_number);

  std::string path_;
  std::string temporary_path_;
  std::string buffer_;  ///< Buffers small writes.
  int descriptor_ = -1;
};

/// Writes a complete file by means of AtomicFile.
void writeFileAtomically(const std::string& path, const std::string& content);

}  // namespace dtsdf
