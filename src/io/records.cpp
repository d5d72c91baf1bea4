#include "io/records.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include "params/printable.h"

namespace dtsdf {
namespace {

constexpr char kMagic[] = "DTSDFREC";
/// zstd compression level; docs/results/performance.md lists sizes and times.
constexpr int kCompressionLevel = 1;
/// zstd's maximum compression ratio: 128 KiB in four bytes.
constexpr uint64_t kMaxCompression = 32768;

Bytes compressed(const void* content, size_t bytes) {
  Bytes stored(ZSTD_compressBound(bytes));
  const size_t size =
      ZSTD_compress(stored.data(), stored.size(), content, bytes, kCompressionLevel);
  if (ZSTD_isError(size)) {
    throw std::runtime_error(std::string("cannot compress: ") + ZSTD_getErrorName(size));
  }
  stored.resize(size);
  return stored;
}

/// The part of a record's header that its checksum covers.
Bytes beginOf(const Record& record) {
  ByteWriter head;
  head.putText(record.name()).put(record.flags).put(record.stored_bytes);
  return std::move(head.bytes);
}

Bytes headOf(const Record& record) {
  ByteWriter head;
  head.bytes = beginOf(record);
  head.put(record.checksum);
  return std::move(head.bytes);
}

uint64_t storedChecksum(const Record& record, const void* stored) {
  const Bytes begin = beginOf(record);
  return hashOf(stored, record.stored_bytes, hashOf(begin.data(), begin.size()));
}

}  // namespace

uint64_t hashOf(const void* data, size_t bytes, uint64_t seed) { return XXH64(data, bytes, seed); }

uint64_t checksumOf(const char* kind, const void* content, size_t bytes) {
  return hashOf(content, bytes, numberOf<uint32_t>(reinterpret_cast<const uint8_t*>(kind)));
}

Bytes fileHead(const char* purpose) {
  ByteWriter head;
  head.putText(kMagic).put(kRecordVersion).putText(purpose);
  return std::move(head.bytes);
}

Bytes encodeStored(const char* kind, uint32_t flags, const void* stored, size_t bytes) {
  Record record;
  std::copy_n(kind, record.kind.size(), record.kind.begin());
  record.flags = flags;
  record.stored_bytes = bytes;
  record.checksum = storedChecksum(record, stored);
  Bytes encoded = headOf(record);
  const auto* const first = static_cast<const uint8_t*>(stored);
  encoded.insert(encoded.end(), first, first + bytes);
  return encoded;
}

Bytes encodeRecord(const char* kind, uint32_t flags, const void* content, size_t bytes) {
  if (!(flags & kZstd)) return encodeStored(kind, flags, content, bytes);
  const Bytes stored = compressed(content, bytes);
  return encodeStored(kind, flags, stored.data(), stored.size());
}

void RecordWriter::put(const Bytes& encoded) {
  sink_(encoded);
  heads_.insert(heads_.end(), encoded.begin(), encoded.begin() + kRecordHeadBytes);
  bytes_ += encoded.size();
  ++records_;
}

RecordFile::RecordFile(const std::string& path, const char* purpose, const std::string& what)
    : path_(path), what_(what) {
  // Without O_NONBLOCK, opening a pipe would wait for a writer.
  descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor_ < 0) throwCannotRead(errno);
  try {
    readHead(purpose);
    readAppended();
  } catch (...) {
    close(descriptor_);
    throw;
  }
}

RecordFile::~RecordFile() { close(descriptor_); }

void RecordFile::readHead(const char* purpose) {
  struct stat status;
  if (fstat(descriptor_, &status) != 0) throwCannotRead(errno);
  if (!S_ISREG(status.st_mode)) throwCannotRead(S_ISDIR(status.st_mode) ? EISDIR : EINVAL);
  bytes_ = static_cast<uint64_t>(status.st_size);
  uint8_t head[kFileHeadBytes] = {};
  readAt(0, head, std::min<uint64_t>(bytes_, kFileHeadBytes));
  const Bytes expected = fileHead(purpose);
  if (bytes_ < kFileHeadBytes || !std::equal(kMagic, kMagic + 8, head) ||
      !std::equal(expected.begin() + 12, expected.end(), head + 12)) {
    throw std::runtime_error("'" + printable(path_) + "' is not a " + what_);
  }
  const auto version = numberOf<uint32_t>(head + 8);
  if (version == kRecordVersion) return;
  throw std::runtime_error("the " + what_ + " '" + printable(path_) + "' has format version " +
                           std::to_string(version) + ", but this program reads version " +
                           std::to_string(kRecordVersion) +
                           "; use a newer version of dtsdf_mapping");
}

bool RecordFile::hasPurpose(const std::string& path, const char* purpose) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::ifstream file(path, std::ios::binary);
  Bytes head(kFileHeadBytes);
  file.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  return file.good() && head == fileHead(purpose);
}

void RecordFile::readAppended() {
  struct stat status;
  if (fstat(descriptor_, &status) != 0) throwCannotRead(errno);
  bytes_ = static_cast<uint64_t>(status.st_size);
  while (end_ + kRecordHeadBytes <= bytes_) {
    Bytes head(kRecordHeadBytes);
    readAt(end_, head.data(), head.size());
    ByteReader in(head);
    Record record;
    std::copy_n(in.takeBytes(4), 4, record.kind.begin());
    record.flags = in.take<uint32_t>();
    record.stored_bytes = in.take<uint64_t>();
    record.checksum = in.take<uint64_t>();
    record.offset = end_ + kRecordHeadBytes;
    if (record.stored_bytes > bytes_ - record.offset) return;
    if (records_.size() >= kMaxRecords) throwDamaged("it has too many records");
    records_.push_back(record);
    end_ = record.offset + record.stored_bytes;
  }
}

void RecordFile::readAt(uint64_t offset, void* data, size_t bytes) const {
  auto* to = static_cast<uint8_t*>(data);
  while (bytes > 0) {
    const ssize_t got = pread(descriptor_, to, bytes, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throwCannotRead(errno);
    if (got == 0) throwDamaged("its end is missing");  // truncated while it was being read
    to += got;
    offset += static_cast<uint64_t>(got);
    bytes -= static_cast<size_t>(got);
  }
}

/// Checks the size before allocating memory. @param most Maximum size of the content.
Bytes RecordFile::readStored(const Record& record, uint64_t most) const {
  if (record.stored_bytes > ZSTD_compressBound(most)) throwWrongSize(record);
  Bytes stored(record.stored_bytes);
  readAt(record.offset, stored.data(), stored.size());
  if (storedChecksum(record, stored.data()) == record.checksum) return stored;
  throwDamaged("the checksum of a " + printable(record.name()) + " record does not match");
}

void RecordFile::unpack(const Record& record, const Bytes& stored, void* content,
                        uint64_t bytes) const {
  if (record.flags & kZstd) {
    const size_t got = ZSTD_decompress(content, bytes, stored.data(), stored.size());
    if (ZSTD_isError(got) || got != bytes) throwWrongSize(record);
  } else {
    if (stored.size() != bytes) throwWrongSize(record);
    std::copy(stored.begin(), stored.end(), static_cast<uint8_t*>(content));
  }
}

void RecordFile::read(const Record& record, void* content, uint64_t bytes) const {
  unpack(record, readStored(record, bytes), content, bytes);
}

Bytes RecordFile::read(const Record& record, uint64_t most) const {
  const Bytes stored = readStored(record, most);
  uint64_t bytes = stored.size();
  if (record.flags & kZstd) {
    bytes = ZSTD_getFrameContentSize(stored.data(), stored.size());  // error codes exceed any limit
  }
  if (bytes > most || bytes / kMaxCompression > stored.size()) throwWrongSize(record);
  Bytes content(bytes);
  unpack(record, stored, content.data(), bytes);
  return content;
}

uint64_t RecordFile::headHash(size_t first, size_t end) const {
  Bytes heads;
  for (size_t i = first; i < end; ++i) {
    const Bytes head = headOf(records_[i]);
    heads.insert(heads.end(), head.begin(), head.end());
  }
  return hashOf(heads.data(), heads.size());
}

void RecordFile::throwDamaged(const std::string& how) const {
  throw std::runtime_error("the " + what_ + " '" + printable(path_) + "' is damaged (" + how +
                           "); use an undamaged copy");
}

void RecordFile::throwCannotRead(int error_number) const {
  throw std::runtime_error("cannot read the " + what_ + " '" + printable(path_) +
                           "': " + std::generic_category().message(error_number) +
                           "; give the path of a " + what_);
}

void RecordFile::throwWrongSize(const Record& record) const {
  throwDamaged("a " + printable(record.name()) + " record has the wrong size");
}

}  // namespace dtsdf
