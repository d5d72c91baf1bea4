/// A file that is either written whole or not at all: a failed save leaves the old file as it was.
#pragma once

#include <cstddef>
#include <string>

namespace dtsdf {

/// Checks before long work that a file can be written: makes missing folders, and refuses a target
/// that exists and is not a regular file.
/// @throws std::runtime_error that names the path and says what to do.
void prepareOutputFile(const std::string& path);

/// Writes a hidden file beside the target, and puts it in place in commit() by one rename. Without
/// commit() it is removed; only where the process is killed, it stays. Every error is a
/// std::runtime_error that names the path and says what to do.
class AtomicFile {
 public:
  /// Makes missing folders and opens the file beside `path`.
  explicit AtomicFile(const std::string& path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* data, size_t bytes);
  void write(const std::string& text) { write(text.data(), text.size()); }

  /// Brings the bytes to the disk and gives the file its name.
  void commit();

 private:
  void flush();
  void closeAndRemove() noexcept;
  [[noreturn]] void fail(int error_number);

  std::string path_;
  std::string temporary_path_;
  std::string buffer_;  ///< Many small writes become few system calls.
  int descriptor_ = -1;
};

/// Writes a whole file by AtomicFile.
void writeFileAtomically(const std::string& path, const std::string& content);

}  // namespace dtsdf
