// Maps to records: one after the other, those of voxels and colours compressed by many threads.
#include <algorithm>
#include <mutex>
#include <stdexcept>
#include <utility>

#include "io/atomic_file.h"
#include "io/map_chunks.h"
#include "io/map_format.h"
#include "map/block_extent.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

using namespace map_format;

static_assert(kBlocksPerMapChunk == kBlocksPerChunk, "one size of chunks");

Bytes bytesOf(const std::string& text) { return {text.begin(), text.end()}; }

/// The settings of a file. @throws std::runtime_error for what no reader takes.
std::string checkedSettings(const MapContents& head) {
  std::string text = settingsText(settingsOfFile(head.settings, head.poses));
  MapContents back;
  if (text.size() > kMostText || head.map_frame.size() > kMostText) {
    throw std::runtime_error(
        "the map cannot be saved: its settings or the name of its frame are "
        "longer than 1 MiB");
  }
  if (!parseSettings(text, back.settings)) {
    throw std::runtime_error("the map cannot be saved: a setting is not of one line");
  }
  withSettingsOf(back, {});
  posesOf(back.settings);
  return text;
}

void putHead(const MapContents& head, const MapBox* box, const MapSize& size, RecordWriter& out) {
  const std::string settings = checkedSettings(head);
  out.put(kSettings, 0, bytesOf(settings));
  out.put(kFrame, 0, bytesOf(head.map_frame));
  if (head.T_W_M) {
    ByteWriter level;
    level.putPose(*head.T_W_M);
    out.put(kLevel, 0, level.bytes);
  }
  if (box != nullptr) out.put(kBox, kZstd, encodeBox(*box));
  out.put(kState, 0, encodeState(head, size));
  out.put(kBlocks, kZstd, encodeBlocks(head.blocks));
  if (head.painted) out.put(kColourIndex, kZstd, encodeColourIndex(head));
  if (head.cell_voxels != 0) out.put(kFree, kZstd, encodeFree(head));
}

/// A record, and the checksum of its content.
using SummedRecord = std::pair<Bytes, uint64_t>;

/// Calls take(number, {of voxels, of colours}) for one chunk after the other, with what `make` has
/// made of a kind of record and its content.
template <class Make, class Take>
void visitChunks(const MapContents& head, const ReadChunk& read, int threads, const Make& make,
                 const Take& take) {
  const ChunkBounds bounds = boundsOf(head.blocks);
  std::mutex reading;
  const auto makeChunk = [&](size_t i) {
    const ChunkWords words = [&] {
      const std::lock_guard<std::mutex> lock(reading);
      return read(i);
    }();
    const auto bytesIn = [i](const std::vector<size_t>& word, size_t size) {
      return (word[i + 1] - word[i]) * size;
    };
    auto voxels = make(kVoxels, words.voxels, bytesIn(bounds.voxel_word, sizeof(uint64_t)));
    if (!head.painted) return std::make_pair(std::move(voxels), decltype(voxels)());
    auto colours = make(kColours, words.colours, bytesIn(bounds.colour_word, sizeof(uint32_t)));
    return std::make_pair(std::move(voxels), std::move(colours));
  };
  makeInOrder(bounds.count(), std::min(threadCount(threads), kMostChunksAtOnce), makeChunk, take);
}

ReadChunk readerOf(const MapContents& contents) {
  return [&contents, bounds = boundsOf(contents.blocks)](size_t chunk) -> ChunkWords {
    return {contents.voxels.data() + bounds.voxel_word[chunk],
            contents.colours.data() + bounds.colour_word[chunk], nullptr};
  };
}

/// Reads chunks of a mapper's map.
ReadChunk readerOf(Mapper& mapper, const MapContents& outline) {
  return [&mapper, &outline](size_t chunk) -> ChunkWords {
    const auto at = [&](size_t chunks) {
      const size_t block = std::min(outline.blocks.size(), chunks * kBlocksPerChunk);
      return outline.blocks.begin() + static_cast<std::ptrdiff_t>(block);
    };
    const auto part =
        std::make_shared<MapContents>(mapper.part(std::vector<MapBlock>(at(chunk), at(chunk + 1))));
    return {part->voxels.data(), part->colours.data(), part};
  };
}

MapContents outlineWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents outline = mapper.outline();
  static_cast<MapOrigin&>(outline) = origin;
  return outline;
}

}  // namespace

SavedMap writeMap(const MapContents& head, const ReadChunk& read, RecordWriter& out, int threads,
                  const MapBox* box) {
  SavedMap saved;
  checkHead(head);
  saved.size = sizeOf(head);
  putHead(head, box, saved.size, out);
  ContentHash hash(head);
  ByteWriter sums;
  const auto put = [&](const SummedRecord& record) {
    hash.add(record.second);
    sums.put(record.second);
    out.put(record.first);
  };
  visitChunks(
      head, read, threads,
      [](const char* kind, const void* words, size_t bytes) {
        return SummedRecord(encodeRecord(kind, kZstd, words, bytes),
                            checksumOf(kind, words, bytes));
      },
      [&](size_t, const std::pair<SummedRecord, SummedRecord>& chunk) {
        put(chunk.first);
        if (head.painted) put(chunk.second);
      });
  saved.content_hash = hash.result();
  ByteWriter end;
  end.put(out.records()).put(out.headHash()).put(saved.content_hash);
  end.bytes.insert(end.bytes.end(), sums.bytes.begin(), sums.bytes.end());
  out.put(kEnd, 0, end.bytes);
  return saved;
}

SavedMap saveMapInChunks(const MapContents& head, const ReadChunk& read, const std::string& path,
                         int threads, const MapBox* box) {
  AtomicFile file(path);
  file.write(fileHead(kPurpose).data(), kFileHeadBytes);
  RecordWriter out([&](const void* data, size_t bytes) { file.write(data, bytes); });
  SavedMap saved = writeMap(head, read, out, threads, box);
  file.commit();
  saved.file_bytes = kFileHeadBytes + out.bytes();
  return saved;
}

SavedMap saveMap(const MapContents& contents, const std::string& path, int threads) {
  checkContents(contents);
  return saveMapInChunks(contents, readerOf(contents), path, threads);
}

uint64_t contentHash(const MapContents& contents, int threads) {
  checkContents(contents);
  ContentHash hash(contents);
  visitChunks(contents, readerOf(contents), threads, checksumOf,
              [&](size_t, const std::pair<uint64_t, uint64_t>& chunk) {
                hash.add(chunk.first);
                if (contents.painted) hash.add(chunk.second);
              });
  return hash.result();
}

MapContents contentsWith(const MapOrigin& origin, Mapper& mapper) {
  MapContents contents = mapper.contents();
  static_cast<MapOrigin&>(contents) = origin;
  return contents;
}

SavedMap saveMapOf(Mapper& mapper, const MapOrigin& origin, const std::string& path) {
  for (;;) {  // once more without blocks that turn out to be damaged
    const uint64_t lost = mapper.stats().pages.lost;
    const MapContents outline = outlineWith(origin, mapper);
    const SavedMap saved = saveMapInChunks(outline, readerOf(mapper, outline), path);
    if (mapper.stats().pages.lost == lost) return saved;
  }
}

SavedMap saveBoxOf(Mapper& mapper, const MapOrigin& origin, const MapBox& box,
                   const std::string& path) {
  MapContents outline = outlineWith(origin, mapper);
  const BlockExtent extent{box.first, box.last};
  auto& blocks = outline.blocks;
  blocks.erase(std::remove_if(blocks.begin(), blocks.end(),
                              [&](const MapBlock& block) { return !extent.contains(block.key); }),
               blocks.end());
  return saveMapInChunks(outline, readerOf(mapper, outline), path, 0, &box);
}

SavedMap writeMapOf(Mapper& mapper, const MapOrigin& origin, RecordWriter& out) {
  const MapContents outline = outlineWith(origin, mapper);
  return writeMap(outline, readerOf(mapper, outline), out);
}

}  // namespace dtsdf
