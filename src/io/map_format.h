/// The bytes of a map file, one rule for writer and reader: docs/map_format.md.
#pragma once

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/map_contents.h"
#include "io/little_endian.h"
#include "params/printable.h"

namespace dtsdf {
namespace map_format {

constexpr char kMagic[] = "DTSDFMAP";
constexpr uint32_t kVersion = 1;
constexpr size_t kFileHeaderBytes = 16;
constexpr size_t kSectionHeaderBytes = 40;

/// Sections of this version, in the order of the file.
constexpr char kSettings[] = "SETT", kFrame[] = "FRAM", kState[] = "STAT", kBlocks[] = "BLKS",
               kColourIndex[] = "COLI", kVoxels[] = "VOXL", kColours[] = "COLR", kFree[] = "FREE",
               kLevel[] = "LEVL", kEnd[] = "END ";
constexpr uint16_t kSectionVersion = 1;
constexpr uint16_t kRequired = 1, kCompressed = 2;  // flags

/// A section of voxels or colours has those of so many blocks, the last one what is left.
constexpr size_t kBlocksPerChunk = 256;
constexpr size_t kMostBlocksPerChunk = 65536;

/// More than any file of a map has, and few enough to be listed.
constexpr size_t kMostSections = 1 << 20;

/// Compressed data are at least this part of what they hold: in a zstd frame, four bytes stand for
/// 128 KiB at most.
constexpr uint64_t kMostCompression = 32768;

constexpr size_t kArrayWords = 512, kBrickWords = 64;
constexpr size_t kStateBytes = 48, kBlockBytes = 16, kEndBytes = 32;
constexpr size_t kColourHeadBytes = 16, kBlockBricksBytes = 8;
constexpr size_t kPoseBytes = 96;
constexpr size_t kFreeHeadBytes = 8, kFreeRecordBytes = 80;

using Bytes = std::vector<uint8_t>;

inline uint64_t hashOf(const void* data, size_t bytes) { return XXH64(data, bytes, 0); }

/// Appends numbers.
class ByteWriter {
 public:
  template <class Number>
  ByteWriter& put(Number number) {
    const auto more = littleEndianBytes(number);
    bytes.insert(bytes.end(), more.begin(), more.end());
    return *this;
  }
  ByteWriter& putText(const std::string& text) {
    bytes.insert(bytes.end(), text.begin(), text.end());
    return *this;
  }
  ByteWriter& putKey(const Vec3i& key) { return put(key.x).put(key.y).put(key.z); }
  ByteWriter& putVector(const Eigen::Vector3d& v) { return put(v.x()).put(v.y()).put(v.z()); }
  /// Its first three rows: kPoseBytes.
  ByteWriter& putPose(const Eigen::Isometry3d& pose) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) put(pose.matrix()(row, column));
    }
    return *this;
  }
  std::string text() const { return {bytes.begin(), bytes.end()}; }

  Bytes bytes;
};

/// Takes them again. @pre There are as many bytes as are taken.
class ByteReader {
 public:
  explicit ByteReader(const uint8_t* data) : next_(data) {}

  template <class Number>
  Number take() {
    next_ += sizeof(Number);
    return numberOf<Number>(next_ - sizeof(Number));
  }
  Vec3i takeKey() {
    const auto x = take<int32_t>(), y = take<int32_t>(), z = take<int32_t>();
    return {x, y, z};
  }
  Eigen::Isometry3d takePose() {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) pose.matrix()(row, column) = take<double>();
    }
    return pose;
  }

 private:
  const uint8_t* next_;
};

/// What stands before each section's bytes.
struct SectionHeader {
  std::array<char, 4> id = {};
  uint16_t version = kSectionVersion;
  uint16_t flags = 0;
  uint64_t stored_bytes = 0;
  uint64_t content_bytes = 0;  ///< Uncompressed.
  uint64_t hash = 0;           ///< Of the stored bytes.

  bool is(const char* name) const { return std::equal(id.begin(), id.end(), name); }
  std::string name() const { return {id.begin(), id.end()}; }
  /// For messages: four letters, but for files that somebody made to be wrong.
  std::string shownName() const { return printable(name()); }
  bool isRequired() const { return (flags & kRequired) != 0; }
  bool isCompressed() const { return (flags & kCompressed) != 0; }
};

/// The header's bytes, with their own checksum at the end.
Bytes encodeHeader(const SectionHeader& header);

/// False if the checksum does not fit.
bool decodeHeader(const uint8_t* bytes, SectionHeader& header);

/// The settings of a file: those of the map, and poses/... unless poses were taken as given.
ParamTree settingsOfFile(const ParamTree& of_map, const PoseParams& poses);

/// The settings poses/... among these. @throws ParamError if a value is invalid.
PoseParams posesOf(const ParamTree& settings);

/// Settings as lines "key: value" in the order of their keys; numbers read back as they were.
std::string settingsText(const ParamTree& settings);

/// False if a line is not of that form.
bool parseSettings(const std::string& text, ParamTree& settings);

/// The settings that a map is bound to, as they enter its content hash.
std::string boundSettingsText(const ParamTree& settings);

/// Contents of the small sections.
Bytes encodeState(const MapContents& contents, const MapSize& size);
Bytes encodeBlocks(const std::vector<MapBlock>& blocks);
Bytes encodeColourIndex(const MapContents& contents);
Bytes encodeFree(const MapContents& contents);

/// What lies where in voxels and colours: blocks and words before each chunk, and after the last.
struct ChunkBounds {
  std::vector<size_t> block, voxel_word, colour_word;

  size_t count() const { return block.size() - 1; }
};
ChunkBounds boundsOf(const std::vector<MapBlock>& blocks, size_t blocks_per_chunk);

/// The content hash, from its parts in their order.
class ContentHash {
 public:
  ContentHash(const MapContents& contents, const MapSize& size);

  /// Hashes the voxels and colours of the blocks of a chunk, which begin at `words`. Safe to call
  /// from several threads, for different chunks.
  void addVoxels(const ChunkBounds& bounds, size_t chunk, const uint64_t* words);
  void addColours(const ChunkBounds& bounds, size_t chunk, const uint32_t* words);

  /// When all were added.
  uint64_t result() const;

 private:
  const MapContents& contents_;
  const MapSize size_;
  std::vector<uint64_t> of_voxels_, of_colours_;  ///< By block.
};

}  // namespace map_format
}  // namespace dtsdf
