/// The records of a map, shared by writer and reader; see docs/map_format.md.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "io/records.h"

namespace dtsdf {

template <class Io>
void fields(Io& io, MapBlock& block) {
  io(block.key, block.directions);
}
template <class Io>
void fields(Io& io, MapFreeCube& cube) {
  uint32_t zero = 0;
  io(cube.key, zero);
  for (uint64_t& word : cube.cells) io(word);
}

namespace map_format {

/// Four-letter code that identifies map files.
constexpr char kPurpose[] = "MAP ";

/// Kinds of records, in file order.
constexpr char kSettings[] = "SETT", kFrame[] = "FRAM", kLevel[] = "LEVL", kBox[] = "BOX ",
               kState[] = "STAT", kBlocks[] = "BLKS", kColourIndex[] = "COLI", kFree[] = "FREE",
               kVoxels[] = "VOXL", kColours[] = "COLR", kEnd[] = "END ";

/// Maximum number of chunks in memory at once, with any number of threads.
constexpr int kMaxChunksAtOnce = 4;

constexpr size_t kArrayWords = 512, kBrickWords = 64;
/// Maximum size of the settings, and of the frame's name, in bytes.
constexpr uint64_t kMaxText = 1 << 20;
/// Maximum size of a box record, in bytes.
constexpr uint64_t kMaxBox = 1 << 28;

/// The settings to store in a file: the map's settings and, unless the input poses were used
/// unchanged, those under poses/.
ParamTree settingsOfFile(const ParamTree& of_map, const PoseParams& poses);

/// Reads the settings under poses/. @throws ParamError if a value is invalid.
PoseParams posesOf(const ParamTree& settings);

/// Settings as lines "key: value", sorted by key; parseYamlParams() reads them back unchanged,
/// unless a value contains a line break.
std::string settingsText(const ParamTree& settings);

/// The settings that cannot change during the life of a map, as text for its content hash.
std::string boundSettingsText(const ParamTree& settings);

template <class Io, class Contents, class Size>
void visitState(Io& io, Contents& contents, Size& size) {
  static_assert(sizeof(size_t) == sizeof(uint64_t), "sizes are written as 64-bit numbers");
  io(contents.frames, contents.supporting_frames, size.blocks, size.voxel_arrays, contents.stamp_s);
}

/// Describes the tables of a map, in file order: calls `visit` with the kind of each record,
/// whether the map has it, and a function that reads or writes its content.
template <class Contents, class Visit>
void visitTables(Contents& map, const Visit& visit) {
  visit(kBlocks, true, [&](auto& io) { io.rest(map.blocks); });
  visit(kColourIndex, map.painted, [&](auto& io) {
    uint32_t zero = 0;
    for (auto& gain : map.exposure) io(gain);
    io(zero);
    for (auto& block : map.blocks) io(block.bricks);
  });
  visit(kFree, map.cell_voxels != 0, [&](auto& io) {
    uint32_t zero = 0;
    io(map.cell_voxels, zero);
    io.rest(map.free_cubes);
  });
}

/// The bytes that visit(io) writes.
template <class Visit>
Bytes encoded(const Visit& visit) {
  ByteWriter out;
  visit(out);
  return std::move(out.bytes);
}

/// The content hash of a map whose voxels and colours have these checksums, in file order.
uint64_t contentHashOf(const MapContents& head, const std::vector<uint64_t>& sums);

}  // namespace map_format
}  // namespace dtsdf
