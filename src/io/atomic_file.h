/// A file that is either written whole or not at all: a failed save leaves the old file as it was.
#pragma once

#include <cstddef>
#include <string>

namespace dtsdf {

/// Checks, before long work, that a file can be written. Creates missing folders; refuses a target
/// that exists and is not a regular file.
/// @throws std::runtime_error that names the path and says what to do.
void prepareOutputFile(const std::string& path);

/// Writes to a hidden file next to the target; commit() renames it into place. Without commit() the
/// hidden file is removed, unless the process is killed. Every error is a std::runtime_error that
/// names the path and says what to do.
class AtomicFile {
 public:
  /// Creates missing folders and opens the hidden file.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, size_t bytes);
  void write(const std::string& text) { write(text.data(), text.size()); }

  /// Syncs the file to disk and gives it its final name.
  void commit();

 private:
  void flush();
  void closeAndRemove() noexcept;
  [[noreturn]] void fail(int error_number);

  std::string path_;
  std::string temporary_path_;
  std::string buffer_;  ///< Joins small writes, to save system calls.
  int descriptor_ = -1;
};

/// Writes a whole file with AtomicFile.
void writeFileAtomically(const std::string& path, const std::string& content);

}  // namespace dtsdf
