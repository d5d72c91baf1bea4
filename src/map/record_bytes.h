/// What blocks hold, back to back in memory, on its way between a map and a disk.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <utility>

#include "dtsdf_mapping/map_contents.h"

namespace dtsdf {

/// Any thread may use it.
class RecordBytes {
 public:
  explicit RecordBytes(size_t size) : size_(size) {}
  virtual ~RecordBytes() = default;
  RecordBytes(const RecordBytes&) = delete;
  RecordBytes& operator=(const RecordBytes&) = delete;

  size_t size() const { return size_; }
  virtual char* data() = 0;

  /// Waits until they are there: a device may still be sending them.
  virtual void wait() {}

 private:
  const size_t size_;
};

using SharedRecords = std::shared_ptr<RecordBytes>;

/// Makes memory for so many bytes of records. Any thread may call it.
using RecordsMaker = std::function<SharedRecords(size_t)>;

/// Where a block's record is.
struct RecordPlace {
  SharedRecords records;  ///< Null: nowhere.
  size_t begin = 0;
  const char* data() const { return records->data() + begin; }
};

/// Of the host.
class PlainRecords : public RecordBytes {
 public:
  explicit PlainRecords(PlainArray<char> bytes)
      : RecordBytes(bytes.size()), bytes_(std::move(bytes)) {}
  char* data() override { return bytes_.data(); }

 private:
  PlainArray<char> bytes_;
};

inline SharedRecords makePlainRecords(size_t bytes) {
  return std::make_shared<PlainRecords>(PlainArray<char>(bytes));
}

}  // namespace dtsdf
