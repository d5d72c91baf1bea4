// Writes maps as records. Several threads compress voxels and colours.
#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/yaml_params.h"
#include "io/atomic_file.h"
#include "io/map_chunks.h"
#include "io/map_format.h"
#include "map/block_extent.h"
#include "threads/parallel.h"

namespace dtsdf {

size_t chunkCount(const std::vector<MapBlock>& blocks) {
  return (blocks.size() + kBlocksPerChunk - 1) / kBlocksPerChunk;
}

std::vector<MapBlock> blocksOfChunk(const std::vector<MapBlock>& blocks, size_t chunk) {
  const auto at = [&](size_t i) {
    return blocks.begin() + static_cast<std::ptrdiff_t>(std::min(blocks.size(), i));
  };
  return {at(chunk * kBlocksPerChunk), at((chunk + 1) * kBlocksPerChunk)};
}

namespace {

using namespace map_format;

Bytes bytesOf(const std::string& text) { return {text.begin(), text.end()}; }

/// The text of the settings. @throws std::runtime_error if readers would reject it.
std::string checkedSettings(const MapContents& head) {
  const ParamTree settings = settingsOfFile(head.settings, head.poses);
  std::string text = settingsText(settings);
  MapContents back;
  if (text.size() > kMaxText || head.map_frame.size() > kMaxText) {
    throw std::runtime_error(
        "the map cannot be saved: its settings or the name of its frame are longer than 1 MiB");
  }
  back.settings = parseYamlParams(text, "the map cannot be saved: its settings");
  if (settingsText(back.settings) != text) {
    throw std::runtime_error("the map cannot be saved: a setting contains a line break");
  }
  withSettingsOf(back, {});
  posesOf(back.settings);
  return text;
}

void putHead(const MapContents& head, const MapBox* box, const MapSize& size, RecordWriter& out) {
  const std::string settings = checkedSettings(head);
  out.put(kSettings, 0, bytesOf(settings));
  out.put(kFrame, 0, bytesOf(head.map_frame));
  if (head.T_W_M) out.put(kLevel, 0, ByteWriter().put(*head.T_W_M).bytes);
  if (box != nullptr) out.put(kBox, kZstd, ByteWriter().put(*box).bytes);
  out.put(kState, 0, encoded([&](ByteWriter& to) { visitState(to, head, size); }));
  visitTables(head, [&](const char* kind, bool is_present, const auto& content) {
    if (is_present) out.put(kind, kZstd, encoded(content));
  });
}

/// An encoded record, and the checksum of its uncompressed content.
using SummedRecord = std::pair<Bytes, uint64_t>;

template <class Word>
SummedRecord encodeWords(const char* kind, const PlainArray<Word>& words) {
  const size_t bytes = words.size() * sizeof(Word);
  return {encodeRecord(kind, kZstd, words.data(), bytes), checksumOf(kind, words.data(), bytes)};
}

template <class Word>
PlainArray<Word> slice(const PlainArray<Word>& words, size_t first, size_t end) {
  PlainArray<Word> copy(end - first);
  std::copy(words.data() + first, words.data() + end, copy.data());
  return copy;
}

ReadChunk readerOf(const MapContents& contents) {
  std::vector<size_t> voxel{0}, colour{0};  // first word of each chunk
  for (size_t i = 0; i < chunkCount(contents.blocks); ++i) {
    const MapSize size = sizeOf(blocksOfChunk(contents.blocks, i));
    voxel.push_back(voxel.back() + size.voxel_arrays * kArrayWords);
    colour.push_back(colour.back() + size.bricks * kBrickWords);
  }
  return [&contents, voxel, colour](size_t chunk) {
    MapContents part;
    part.voxels = slice(contents.voxels, voxel[chunk], voxel[chunk + 1]);
    part.colours = slice(contents.colours, colour[chunk], colour[chunk + 1]);
    return part;
  };
}

ReadChunk readerOf(Mapper& mapper, const MapContents& outline) {
  return [&](size_t chunk) { return mapper.part(blocksOfChunk(outline.blocks, chunk)); };
}

MapContents outlineWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents outline = mapper.outline();
  static_cast<MapOrigin&>(outline) = origin;
  return outline;
}

}  // namespace

MapInfo infoOf(const MapContents& head) {
  MapInfo info;
  static_cast<MapHead&>(info) = head;
  info.size = sizeOf(head);
  if (!head.blocks.empty()) info.least = info.most = head.blocks.front().key;
  for (const MapBlock& block : head.blocks) {
    info.least = minOf(info.least, block.key);
    info.most = maxOf(info.most, block.key);
  }
  return info;
}

MapInfo writeMap(const MapContents& head, const ReadChunk& read, RecordWriter& out, int threads,
                 const MapBox* box) {
  checkHead(head);
  MapInfo saved = infoOf(head);
  putHead(head, box, saved.size, out);
  std::mutex reading;
  const auto make = [&](size_t i) {
    const MapContents part = [&] {
      const std::lock_guard<std::mutex> lock(reading);
      return read(i);
    }();
    std::vector<SummedRecord> records{encodeWords(kVoxels, part.voxels)};
    if (head.painted) records.push_back(encodeWords(kColours, part.colours));
    return records;
  };
  std::vector<uint64_t> sums;
  const auto put = [&](size_t, const std::vector<SummedRecord>& records) {
    for (const auto& [record, sum] : records) {
      out.put(record);
      sums.push_back(sum);
    }
  };
  makeInOrder(chunkCount(head.blocks), std::min(threadCount(threads), kMaxChunksAtOnce), make, put);
  saved.content_hash = contentHashOf(head, sums);
  ByteWriter end;
  end(out.records(), out.headHash(), saved.content_hash);
  end.rest(sums);
  out.put(kEnd, 0, end.bytes);
  return saved;
}

MapInfo saveMapInChunks(const MapContents& head, const ReadChunk& read, const std::string& path,
                        int threads, const MapBox* box) {
  AtomicFile file(path);
  file.write(fileHead(kPurpose).data(), kFileHeadBytes);
  RecordWriter out([&](const Bytes& record) { file.write(record.data(), record.size()); });
  MapInfo saved = writeMap(head, read, out, threads, box);
  file.commit();
  saved.file_bytes = kFileHeadBytes + out.bytes();
  return saved;
}

MapInfo saveMap(const MapContents& contents, const std::string& path, int threads) {
  checkContents(contents);
  return saveMapInChunks(contents, readerOf(contents), path, threads);
}

uint64_t contentHash(const MapContents& contents, int threads) {
  checkContents(contents);
  RecordWriter nowhere([](const Bytes&) {});
  return writeMap(contents, readerOf(contents), nowhere, threads).content_hash;
}

MapContents contentsWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents contents = mapper.contents();
  static_cast<MapOrigin&>(contents) = origin;
  return contents;
}

MapInfo saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path) {
  for (;;) {  // if damaged blocks are found, starts again without them
    const uint64_t lost = mapper.stats().pages.lost;
    const MapContents outline = outlineWith(origin, mapper);
    MapInfo saved = saveMapInChunks(outline, readerOf(mapper, outline), path);
    if (mapper.stats().pages.lost == lost) return saved;
  }
}

MapInfo saveBoxOf(Mapper& mapper, const MapOrigin& origin, const MapBox& box,
                  const std::string& path) {
  MapContents outline = outlineWith(origin, mapper);
  const BlockExtent extent{box.first, box.last};
  auto& blocks = outline.blocks;
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(),
                              [&](const MapBlock& block) { return !extent.contains(block.key); }),
               blocks.end());
  return saveMapInChunks(outline, readerOf(mapper, outline), path, 0, &box);
}

}  // namespace dtsdf
