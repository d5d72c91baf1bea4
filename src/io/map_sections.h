/// A map file by its headers: which sections there are, that they are whole, and their bytes.
#pragma once

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "io/map_format.h"

namespace dtsdf {
namespace map_format {

/// A section, and where in the file its bytes begin.
struct PlacedSection {
  SectionHeader header;
  uint64_t offset;
};

/// What a reader of this version does with a section.
inline bool isKnown(const SectionHeader& header) {
  static constexpr const char* kKnown[] = {kSettings,    kFrame,  kLevel,   kState, kBlocks,
                                           kColourIndex, kVoxels, kColours, kFree,  kEnd};
  return header.version <= kSectionVersion && header.version > 0 &&
         std::any_of(std::begin(kKnown), std::end(kKnown),
                     [&](const char* id) { return header.is(id); });
}

/// An open map file whose headers are sound.
class MapFile {
 public:
  explicit MapFile(const std::string& path) : path_(path) {
    // A fifo would wait for somebody to write.
    descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor_ < 0) throwCannotRead(errno);
    try {
      readHeaders();
    } catch (...) {
      close(descriptor_);
      throw;
    }
  }
  ~MapFile() { close(descriptor_); }
  MapFile(const MapFile&) = delete;
  MapFile& operator=(const MapFile&) = delete;

  const std::string& path() const { return path_; }
  const std::vector<PlacedSection>& sections() const { return sections_; }
  uint64_t bytes() const { return bytes_; }
  uint32_t version() const { return version_; }
  uint64_t contentHashInFile() const { return content_hash_; }

  std::vector<const PlacedSection*> all(const char* id) const {
    std::vector<const PlacedSection*> found;
    for (const PlacedSection& section : sections_) {
      if (isKnown(section.header) && section.header.is(id)) found.push_back(&section);
    }
    return found;
  }

  /// Null if it is not there.
  const PlacedSection* find(const char* id) const {
    const std::vector<const PlacedSection*> found = all(id);
    if (found.size() > 1) throwDamaged(std::string("it has more than one part ") + id);
    return found.empty() ? nullptr : found.front();
  }

  const PlacedSection& get(const char* id) const {
    const PlacedSection* const section = find(id);
    if (section == nullptr) throwDamaged(std::string("the part ") + id + " is missing");
    return *section;
  }

  /// What a section holds, which has to be so many bytes. Safe to call from several threads.
  void read(const PlacedSection& section, void* content, uint64_t bytes) const {
    const SectionHeader& header = section.header;
    if (header.content_bytes != bytes) throwWrongSize(header);
    const PlainArray<uint8_t> stored = readStored(section);
    if (!header.isCompressed()) {
      std::copy_n(stored.data(), bytes, static_cast<uint8_t*>(content));
      return;
    }
    const size_t got = ZSTD_decompress(content, bytes, stored.data(), stored.size());
    if (ZSTD_isError(got) || got != bytes) throwWrongSize(header);
  }

  Bytes read(const PlacedSection& section, uint64_t bytes) const {
    if (section.header.content_bytes != bytes) throwWrongSize(section.header);
    Bytes content(bytes);
    read(section, content.data(), bytes);
    return content;
  }

  /// The same for small sections, whatever their size is; they are not compressed.
  Bytes readSmall(const char* id) const {
    const PlacedSection& section = get(id);
    constexpr uint64_t kMostBytes = 1 << 20;
    if (section.header.isCompressed() || section.header.stored_bytes > kMostBytes) {
      throwWrongSize(section.header);
    }
    return read(section, section.header.stored_bytes);
  }

  [[noreturn]] void throwDamaged(const std::string& how) const {
    throw std::runtime_error("the map file '" + path_ + "' is damaged (" + how +
                             "); use a copy of it, or save the map again");
  }

 private:
  [[noreturn]] void throwWrongSize(const SectionHeader& header) const {
    throwDamaged("a part " + header.shownName() + " has the wrong size");
  }

  [[noreturn]] void throwCannotRead(int error_number) const {
    throw std::runtime_error("cannot read the map file '" + path_ +
                             "': " + std::generic_category().message(error_number) +
                             "; give the path of a .dtsdf file");
  }

  [[noreturn]] void throwCutOff() const { throwDamaged("its end is missing"); }

  PlainArray<uint8_t> readStored(const PlacedSection& section) const {
    PlainArray<uint8_t> stored(section.header.stored_bytes);
    readAt(section.offset, stored.data(), stored.size());
    if (hashOf(stored.data(), stored.size()) != section.header.hash) {
      throwDamaged("the checksum of part " + section.header.shownName() + " does not match");
    }
    return stored;
  }

  void readAt(uint64_t offset, uint8_t* data, size_t bytes) const {
    while (bytes > 0) {
      const ssize_t got = pread(descriptor_, data, bytes, static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) throwCannotRead(errno);
      if (got == 0) throwCutOff();  // became shorter meanwhile
      data += got;
      offset += static_cast<uint64_t>(got);
      bytes -= static_cast<size_t>(got);
    }
  }

  void readHeaders() {
    struct stat status;
    if (fstat(descriptor_, &status) != 0) throwCannotRead(errno);
    if (!S_ISREG(status.st_mode)) throwCannotRead(S_ISDIR(status.st_mode) ? EISDIR : EINVAL);
    bytes_ = static_cast<uint64_t>(status.st_size);
    readFileHeader();
    uint64_t at = kFileHeaderBytes;
    while (sections_.empty() || !sections_.back().header.is(kEnd)) {
      const PlacedSection section = readSectionHeader(at);
      at = section.offset + section.header.stored_bytes;
      if (sections_.size() >= kMostSections) throwDamaged("it has too many parts");
      sections_.push_back(section);
    }
    if (at != bytes_) throwDamaged("there is data after its end");
    checkEnd();
    for (const PlacedSection& section : sections_) checkSection(section.header);
  }

  void readFileHeader() {
    headers_.resize(kFileHeaderBytes);
    const size_t magic_bytes = sizeof(kMagic) - 1;
    if (bytes_ < headers_.size()) throwNoMap();
    readAt(0, headers_.data(), headers_.size());
    if (!std::equal(kMagic, kMagic + magic_bytes, headers_.begin())) throwNoMap();
    version_ = ByteReader(headers_.data() + magic_bytes).take<uint32_t>();
    if (version_ > kVersion) {
      throw std::runtime_error("the map file '" + path_ + "' has version " +
                               std::to_string(version_) + " of the format; this program reads " +
                               "up to " + std::to_string(kVersion) + "; use a newer program");
    }
    if (version_ == 0) throwDamaged("version 0 of the format does not exist");
  }

  [[noreturn]] void throwNoMap() const {
    throw std::runtime_error("'" + path_ +
                             "' is not a map file; give one that save_map or "
                             "--save-map wrote");
  }

  PlacedSection readSectionHeader(uint64_t at) {
    if (bytes_ - at < kSectionHeaderBytes) throwCutOff();
    uint8_t bytes[kSectionHeaderBytes];
    readAt(at, bytes, sizeof(bytes));
    PlacedSection section{{}, at + kSectionHeaderBytes};
    if (!decodeHeader(bytes, section.header)) {
      throwDamaged("the checksum of a header does not match");
    }
    if (section.header.stored_bytes > bytes_ - section.offset) throwCutOff();
    if (!section.header.is(kEnd)) headers_.insert(headers_.end(), bytes, bytes + sizeof(bytes));
    return section;
  }

  void checkEnd() {
    const Bytes bytes = read(sections_.back(), kEndBytes);
    ByteReader end(bytes.data());
    const auto sections = end.take<uint64_t>();
    content_hash_ = end.take<uint64_t>();
    const auto hash = end.take<uint64_t>();
    const auto length = end.take<uint64_t>();
    if (sections != sections_.size() - 1 || length != bytes_ ||
        hash != hashOf(headers_.data(), headers_.size())) {
      throwDamaged("its parts are not those that were written");
    }
    headers_ = Bytes();
  }

  void checkSection(const SectionHeader& header) const {
    if (!isKnown(header)) {
      if (!header.isRequired()) return;
      throw std::runtime_error("the map file '" + path_ + "' has a part " + header.shownName() +
                               " that this program does not know; use a newer program");
    }
    if (header.isCompressed() ? header.content_bytes / kMostCompression > header.stored_bytes
                              : header.content_bytes != header.stored_bytes) {
      throwWrongSize(header);
    }
  }

  std::string path_;
  int descriptor_ = -1;
  uint64_t bytes_ = 0, content_hash_ = 0;
  uint32_t version_ = 0;
  Bytes headers_;  ///< While they are read.
  std::vector<PlacedSection> sections_;
};

}  // namespace map_format
}  // namespace dtsdf
