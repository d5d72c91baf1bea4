/// File format of maps, map boxes and journals: a sequence of records {kind, flags, length,
/// checksum, bytes}. docs/map_format.md describes them byte by byte.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/geometry.h"
#include "io/little_endian.h"
#include "map/byte_stream.h"

namespace dtsdf {

/// The XXH64 hash, used for all checksums in files.
uint64_t hashOf(const void* data, size_t bytes, uint64_t seed = 0);

template <class Io>
void fields(Io& io, Vec3i& key) {
  io(key.x, key.y, key.z);
}
template <class Io>
void fields(Io& io, Eigen::Vector3d& v) {
  io(v.x(), v.y(), v.z());
}
/// Reads or writes the first three rows of a pose's matrix: kPoseBytes bytes.
template <class Io>
void fields(Io& io, Eigen::Isometry3d& pose) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) io(pose.matrix()(row, column));
  }
}

constexpr size_t kPoseBytes = 96;

constexpr size_t kFileHeadBytes = 16, kRecordHeadBytes = 24;
constexpr uint32_t kRecordVersion = 1;
/// Maximum number of records in a file, since their headers are kept in memory.
constexpr size_t kMaxRecords = 1 << 22;

/// Flags of a record.
constexpr uint32_t kZstd = 1;          ///< The bytes are one zstd frame.
constexpr uint32_t kMayBeSkipped = 2;  ///< Readers skip the record if its kind is unknown.

/// A record in a file.
struct Record {
  std::array<char, 4> kind = {};
  uint32_t flags = 0;
  uint64_t stored_bytes = 0;
  uint64_t checksum = 0;  ///< Covers the stored bytes and the header before this field.
  uint64_t offset = 0;    ///< Start of the stored bytes in the file.

  bool is(const char* name) const { return std::equal(kind.begin(), kind.end(), name); }
  std::string name() const { return {kind.begin(), kind.end()}; }
};

/// Checksum of uncompressed content, with the kind as seed. Content hashes are computed from such
/// checksums.
uint64_t checksumOf(const char* kind, const void* content, size_t bytes);

/// The header of a file. @param purpose Four-letter code for the file's content.
Bytes fileHead(const char* purpose);

/// A record with its header. The bytes are stored unchanged.
Bytes encodeStored(const char* kind, uint32_t flags, const void* stored, size_t bytes);

/// A record with its header. With kZstd in `flags`, the content is compressed.
/// @throws std::runtime_error if it cannot be compressed.
Bytes encodeRecord(const char* kind, uint32_t flags, const void* content, size_t bytes);
inline Bytes encodeRecord(const char* kind, uint32_t flags, const Bytes& content) {
  return encodeRecord(kind, flags, content.data(), content.size());
}

/// Writes records in order; counts them and hashes their headers for the end record.
class RecordWriter {
 public:
  using Sink = std::function<void(const Bytes& record)>;
  explicit RecordWriter(Sink sink) : sink_(std::move(sink)) {}

  void put(const Bytes& encoded);
  void put(const char* kind, uint32_t flags, const Bytes& content) {
    put(encodeRecord(kind, flags, content));
  }
  uint64_t bytes() const { return bytes_; }
  uint64_t records() const { return records_; }
  /// Hash of the headers of all records so far.
  uint64_t headHash() const { return hashOf(heads_.data(), heads_.size()); }

 private:
  Sink sink_;
  Bytes heads_;
  uint64_t records_ = 0, bytes_ = 0;
};

/// An open record file. The headers of all records are kept in memory; their contents are read on
/// demand.
class RecordFile {
 public:
  /// @param what Kind of file, for error messages, such as "map file".
  /// @throws std::runtime_error if the file cannot be read, is not a regular file, or has another
  /// purpose or version.
  RecordFile(const std::string& path, const char* purpose, const std::string& what);
  ~RecordFile();
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;

  /// Whether `path` is a regular file with this purpose and the current version. Never blocks on a
  /// pipe.
  static bool hasPurpose(const std::string& path, const char* purpose);

  const std::string& path() const { return path_; }
  const std::vector<Record>& records() const { return records_; }
  uint64_t bytes() const { return bytes_; }
  /// Reads the headers of records that were appended since the last call.
  void readAppended();
  /// End of the last complete record.
  uint64_t end() const { return end_; }

  // The functions below are thread-safe, and throw std::runtime_error if the record is damaged.

  /// Reads the content of a record, which must have exactly `bytes` bytes.
  void read(const Record& record, void* content, uint64_t bytes) const;
  /// Reads the content of a record, which may have at most `most` bytes.
  Bytes read(const Record& record, uint64_t most) const;
  /// Passes a ByteReader of the content to `take`, which must read all of it.
  template <class Take>
  void visit(const Record& record, uint64_t most, const Take& take) const {
    const Bytes content = read(record, most);
    ByteReader in(content);
    take(in);
    if (in.left() > 0) throwWrongSize(record);
  }

  /// Hash of the headers of records `first` to `end` - 1, computed like RecordWriter::headHash().
  uint64_t headHash(size_t first, size_t end) const;

  [[noreturn]] void throwDamaged(const std::string& how) const;

 private:
  [[noreturn]] void throwCannotRead(int error_number) const;
  [[noreturn]] void throwWrongSize(const Record& record) const;
  void readHead(const char* purpose);
  void readAt(uint64_t offset, void* data, size_t bytes) const;
  Bytes readStored(const Record& record, uint64_t most) const;
  void unpack(const Record& record, const Bytes& stored, void* content, uint64_t bytes) const;

  std::string path_, what_;
  int descriptor_ = -1;
  uint64_t bytes_ = 0, end_ = kFileHeadBytes;
  std::vector<Record> records_;
};

}  // namespace dtsdf
