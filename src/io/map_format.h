/// The records of a map, one rule for writer and reader: docs/map_format.md.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/io/map_file.h"
#include "dtsdf_mapping/map_contents.h"
#include "io/map_box.h"
#include "io/records.h"

namespace dtsdf {
namespace map_format {

/// What the head of a map file says that it is.
constexpr char kPurpose[] = "MAP ";

/// Kinds of records, in the order of the file.
constexpr char kSettings[] = "SETT", kFrame[] = "FRAM", kLevel[] = "LEVL", kBox[] = "BOX ",
               kState[] = "STAT", kBlocks[] = "BLKS", kColourIndex[] = "COLI", kFree[] = "FREE",
               kVoxels[] = "VOXL", kColours[] = "COLR", kEnd[] = "END ";

/// A record of voxels or colours has those of so many blocks, the last one what is left.
constexpr size_t kBlocksPerChunk = 256;

/// Chunks that are in memory at a time, however many cores there are.
constexpr int kMostChunksAtOnce = 4;

constexpr size_t kArrayWords = 512, kBrickWords = 64;
constexpr size_t kStateBytes = 40, kBlockBytes = 16, kEndBytes = 24;
constexpr size_t kColourHeadBytes = 16, kBlockBricksBytes = 8;
constexpr size_t kFreeHeadBytes = 8, kFreeRecordBytes = 80;
/// Of settings and of the frame's name, in bytes: no more is written or read.
constexpr uint64_t kMostText = 1 << 20;
/// Of the numbers of a box's frames, in bytes.
constexpr uint64_t kMostBox = 1 << 28;

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

/// Contents of the small records.
Bytes encodeState(const MapContents& contents, const MapSize& size);
Bytes encodeBox(const MapBox& box);
Bytes encodeBlocks(const std::vector<MapBlock>& blocks);
Bytes encodeColourIndex(const MapContents& contents);
Bytes encodeFree(const MapContents& contents);

/// What lies where in voxels and colours: blocks and words before each chunk, and after the last.
struct ChunkBounds {
  std::vector<size_t> block, voxel_word, colour_word;

  size_t count() const { return block.size() - 1; }
};
ChunkBounds boundsOf(const std::vector<MapBlock>& blocks);

/// The content hash, from the checksums of what belongs to the map, in the order of the file.
class ContentHash {
 public:
  /// Begins with the settings that a map is bound to, the numbers of its frames, and the tables.
  explicit ContentHash(const MapContents& head);

  /// That of the content of voxels or colours.
  void add(uint64_t checksum) { sums_.put(checksum); }
  uint64_t result() const { return hashOf(sums_.bytes.data(), sums_.bytes.size()); }

 private:
  ByteWriter sums_;
};

}  // namespace map_format
}  // namespace dtsdf
