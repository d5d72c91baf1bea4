/// Builds map files from short recipes, with correct sizes and checksums unless the recipe asks for
/// wrong ones, so that fuzzed files pass the first checks of a reader.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "dtsdf_mapping/io/yaml_params.h"
#include "fuzz/fuzz_input.h"
#include "io/map_chunks.h"
#include "io/map_format.h"

namespace dtsdf {

/// The recipe is split at each record id. After the id come an unused byte, a byte of How bits, and
/// the record's content. Bytes before the first id are dropped.
class MapRecipe {
 public:
  MapRecipe(const uint8_t* data, size_t size) {
    std::vector<size_t> cuts;
    for (size_t at = 0; at + 4 <= size; ++at) {
      if (!isId(data + at)) continue;
      cuts.push_back(at);
      at += 3;  // ids do not overlap
    }
    cuts.push_back(size);
    for (size_t i = 0; i + 1 < cuts.size(); ++i) {
      parts_.push_back(partOf({data + cuts[i], data + cuts[i + 1]}));
    }
    makeConsistent();
  }

  /// The map file with the records of the recipe. An end record gets correct content.
  Bytes file() {
    Bytes file = fileHead(map_format::kPurpose);
    RecordWriter out(
        [&](const Bytes& record) { file.insert(file.end(), record.begin(), record.end()); });
    for (const Part& part : parts_)
      append(part, part.is(map_format::kEnd) ? end(out) : part.content, out);
    return file;
  }

 private:
  /// How a record is written, as bits of the second byte after its id.
  enum How : uint8_t {
    kSkipped = 1,  ///< Flagged as a record that readers may skip.
    kCompressed = 2,
    kKeepsCounts = 4,  ///< Keeps the recipe's counts and length, even if they are wrong.
    kBrokenFrame = 8,  ///< Flagged as compressed, but not compressed.
    kWrongSum = 32,
    kLengthened = 128,  ///< Declares a greater length than it stores.
  };

  struct Part {
    std::array<char, 4> id = {};
    uint8_t how = 0;
    Bytes content;

    bool is(const char* name) const { return std::equal(id.begin(), id.end(), name); }
  };

  static bool isId(const uint8_t* bytes) {
    using namespace map_format;
    for (const char* id : {kSettings, kFrame, kLevel, kBox, kState, kBlocks, kColourIndex, kVoxels,
                           kColours, kFree, kEnd, "XTRA"}) {
      if (std::equal(bytes, bytes + 4, id)) return true;
    }
    return false;
  }

  static Part partOf(const Bytes& bytes) {
    Part part;
    std::copy_n(bytes.begin(), part.id.size(), part.id.begin());
    if (bytes.size() > 5) part.how = bytes[5];
    if (bytes.size() > 6) part.content.assign(bytes.begin() + 6, bytes.end());
    return part;
  }

  /// The first part with this id, or null.
  Part* find(const char* id) {
    const auto found =
        std::find_if(parts_.begin(), parts_.end(), [&](const Part& p) { return p.is(id); });
    return found == parts_.end() ? nullptr : &*found;
  }

  // ---- Consistency between records ----

  /// With more blocks, an input would take too long under a sanitizer without testing more code.
  static constexpr size_t kMaxBlocks = 12;
  static constexpr size_t kStateBytes = 40, kBlockBytes = 16;
  static constexpr size_t kColourHeadBytes = 16, kBlockBricksBytes = 8;

  void makeConsistent() {
    readBlocks();
    readBricks();
    countBlocks();
    fillChunks(map_format::kVoxels, voxelBytes);
    fillChunks(map_format::kColours, colourBytes);
  }

  static size_t voxelBytes(const MapBlock& block) {
    return countBits(block.directions) * map_format::kArrayWords * sizeof(uint64_t);
  }
  static size_t colourBytes(const MapBlock& block) {
    return countBits(block.bricks) * map_format::kBrickWords * sizeof(uint32_t);
  }

  static size_t countBits(uint64_t bits) { return static_cast<size_t>(__builtin_popcountll(bits)); }

  void readBlocks() {
    Part* const part = find(map_format::kBlocks);
    if (part == nullptr) return;
    const size_t bytes = std::min(part->content.size() / kBlockBytes, kMaxBlocks) * kBlockBytes;
    ByteReader(part->content.data(), bytes).rest(blocks_);
    if (!(part->how & kKeepsCounts)) part->content.resize(bytes);
  }

  void readBricks() {
    using namespace map_format;
    Part* const part = find(kColourIndex);
    if (part == nullptr) return;
    if (!(part->how & kKeepsCounts)) {
      part->content.resize(kColourHeadBytes + blocks_.size() * kBlockBricksBytes);
    }
    if (part->content.size() < kColourHeadBytes) return;
    InputBytes in(part->content.data() + kColourHeadBytes, part->content.size() - kColourHeadBytes);
    for (MapBlock& block : blocks_) block.bricks = in.take<uint64_t>();
  }

  void countBlocks() {
    Part* const part = find(map_format::kState);
    if (part == nullptr || part->how & kKeepsCounts) return;
    part->content.resize(kStateBytes);
    size_t arrays = 0;
    for (const MapBlock& block : blocks_) arrays += countBits(block.directions);
    ByteWriter out;
    out.put(uint64_t{blocks_.size()});
    out.put(uint64_t{arrays});
    std::copy(out.bytes.begin(), out.bytes.end(), part->content.begin() + 16);
  }

  /// Repeats the content of each chunk until it is as long as its blocks require.
  template <class BytesOf>
  void fillChunks(const char* id, const BytesOf& bytesOf) {
    size_t next = 0;
    for (Part& part : parts_) {
      if (!part.is(id)) continue;
      size_t bytes = 0;
      for (size_t i = 0; i < kBlocksPerChunk && next < blocks_.size(); ++i) {
        bytes += bytesOf(blocks_[next++]);
      }
      if (part.how & kKeepsCounts) continue;
      const Bytes told = part.content.empty() ? Bytes(1) : part.content;
      part.content.resize(bytes);
      for (size_t i = 0; i < bytes; ++i) part.content[i] = told[i % told.size()];
    }
  }

  // ---- The bytes of the file ----

  static void append(const Part& part, const Bytes& content, RecordWriter& out) {
    const uint32_t flags = (part.how & kSkipped ? kMayBeSkipped : 0) |
                           (part.how & kCompressed && !(part.how & kBrokenFrame) ? kZstd : 0);
    const bool is_broken = (part.how & kBrokenFrame) != 0;
    Bytes record = is_broken
                       ? encodeStored(part.id.data(), flags | kZstd, content.data(), content.size())
                       : encodeRecord(part.id.data(), flags, content.data(), content.size());
    if (part.how & kLengthened) ++record[8];
    if (part.how & kWrongSum) ++record[16];
    out.put(record);
  }

  Bytes end(const RecordWriter& before) {
    ByteWriter out;
    const Bytes of_tables = tableSums(), of_chunks = chunkSums();
    Bytes sums = of_tables;
    sums.insert(sums.end(), of_chunks.begin(), of_chunks.end());
    out.put(before.records()).put(before.headHash()).put(hashOf(sums.data(), sums.size()));
    out.bytes.insert(out.bytes.end(), of_chunks.begin(), of_chunks.end());
    return out.bytes;
  }

  // Checksums of the content that the content hash covers, according to docs/map_format.md.

  static void add(const char* id, const Bytes& content, ByteWriter& sums) {
    sums.put(checksumOf(id, content.data(), content.size()));
  }

  Bytes tableSums() {
    using namespace map_format;
    ByteWriter sums, counts;
    if (const Part* const part = find(kSettings)) {
      const ParamTree told =
          parseYamlParams({part->content.begin(), part->content.end()}, "settings");
      counts.putText(boundSettingsText(told));
    }
    if (const Part* const part = find(kState)) {
      counts.bytes.insert(counts.bytes.end(), part->content.begin(),
                          part->content.begin() + static_cast<std::ptrdiff_t>(
                                                      std::min<size_t>(16, part->content.size())));
    }
    add(kState, counts.bytes, sums);
    for (const char* id : {kBlocks, kColourIndex, kFree}) {
      if (const Part* const part = find(id)) add(id, part->content, sums);
    }
    return std::move(sums.bytes);
  }

  Bytes chunkSums() {
    using namespace map_format;
    ByteWriter sums;
    std::vector<const Part*> voxels, colours;
    for (const Part& part : parts_) {
      if (part.is(kVoxels)) voxels.push_back(&part);
      if (part.is(kColours)) colours.push_back(&part);
    }
    for (size_t i = 0; i < voxels.size(); ++i) {
      add(kVoxels, voxels[i]->content, sums);
      if (find(kColourIndex) != nullptr && i < colours.size()) {
        add(kColours, colours[i]->content, sums);
      }
    }
    return std::move(sums.bytes);
  }

  std::vector<Part> parts_;
  std::vector<MapBlock> blocks_;
};

}  // namespace dtsdf
