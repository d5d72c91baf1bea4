#include "page/page_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "params/printable.h"

namespace dtsdf {
namespace {

std::string textOf(int error) { return std::generic_category().message(error); }

/// A file that has no name from the start, or, where the file system has no such, loses it at once.
int openUnnamed(const std::string& folder) {
  const int file = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != EINVAL)) return file;
  std::string path = folder + "/dtsdf_pages_XXXXXX";
  const int named = mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) unlink(path.c_str());
  return named;
}

}  // namespace

PageFile::PageFile(const std::string& folder) : folder_(folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  file_ = openUnnamed(folder);
  if (file_ < 0) {
    throw std::runtime_error("no file can be made in map/page_folder '" + printable(folder) +
                             "': " + textOf(errno) + "; set it to a folder that can be written");
  }
}

PageFile::~PageFile() { close(file_); }

std::string PageFile::write(uint64_t offset, const char* bytes, size_t size) {
  while (size > 0) {
    const ssize_t done = pwrite(file_, bytes, size, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      return "cannot write to map/page_folder '" + printable(folder_) +
             "': " + textOf(done < 0 ? errno : ENOSPC);
    }
    bytes += done;
    size -= static_cast<size_t>(done);
    offset += static_cast<uint64_t>(done);
  }
  return "";
}

std::string PageFile::read(uint64_t offset, char* bytes, size_t size, bool& is_short) const {
  is_short = false;
  while (size > 0) {
    const ssize_t done = pread(file_, bytes, size, static_cast<off_t>(offset));
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) {
      is_short = done == 0;
      return "cannot read from map/page_folder '" + printable(folder_) +
             "': " + (done < 0 ? textOf(errno) : std::string("the file has become shorter"));
    }
    bytes += done;
    size -= static_cast<size_t>(done);
    offset += static_cast<uint64_t>(done);
  }
  return "";
}

void PageFile::truncate(uint64_t size) {
  if (ftruncate(file_, static_cast<off_t>(size)) != 0) return;  // it stays as long as it was
}

}  // namespace dtsdf
