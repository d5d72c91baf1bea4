// saveMap(): sections one after the other, those of voxels and colours compressed by many threads.
#include <zstd.h>

#include <stdexcept>
#include <utility>

#include "io/atomic_file.h"
#include "io/map_chunks.h"
#include "io/map_format.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace {

using namespace map_format;

/// Higher levels gain nothing on voxels, nor does to split their words into planes of bytes:
/// docs/results/performance.md.
constexpr int kCompressionLevel = 1;

struct Section {
  SectionHeader header;
  Bytes stored;
};

Section makeSection(const char* id, uint16_t flags, Bytes stored, uint64_t content_bytes) {
  Section section;
  std::copy_n(id, section.header.id.size(), section.header.id.begin());
  section.header.flags = flags;
  section.header.stored_bytes = stored.size();
  section.header.content_bytes = content_bytes;
  section.header.hash = hashOf(stored.data(), stored.size());
  section.stored = std::move(stored);
  return section;
}

Section makePlainSection(const char* id, Bytes content) {
  const uint64_t bytes = content.size();
  return makeSection(id, kRequired, std::move(content), bytes);
}

Section makeCompressedSection(const char* id, uint16_t flags, const void* content, size_t size) {
  Bytes stored(ZSTD_compressBound(size));
  const size_t bytes =
      ZSTD_compress(stored.data(), stored.size(), content, size, kCompressionLevel);
  if (ZSTD_isError(bytes)) {
    throw std::runtime_error(std::string("cannot compress the map: ") + ZSTD_getErrorName(bytes));
  }
  stored.resize(bytes);
  return makeSection(id, flags | kCompressed, std::move(stored), size);
}

Section makeCompressedSection(const char* id, uint16_t flags, const Bytes& content) {
  return makeCompressedSection(id, flags, content.data(), content.size());
}

/// The words of a chunk of voxels or colours.
template <class Word>
Section makeChunk(const char* id, uint16_t flags, const Word* words,
                  const std::vector<size_t>& bounds, size_t chunk) {
  return makeCompressedSection(id, flags, words,
                               (bounds[chunk + 1] - bounds[chunk]) * sizeof(Word));
}

Bytes bytesOf(const std::string& text) { return {text.begin(), text.end()}; }

/// The file as it grows.
class MapFileWriter {
 public:
  explicit MapFileWriter(const std::string& path) : file_(path) {
    ByteWriter header;
    header.putText(kMagic);
    header.put(kVersion);
    header.put(uint32_t{0});
    headers_ = header.bytes;
    write(header.bytes);
  }

  void add(const Section& section) {
    const Bytes header = encodeHeader(section.header);
    headers_.insert(headers_.end(), header.begin(), header.end());
    write(header);
    write(section.stored);
    ++sections_;
  }

  /// @return the length of the file.
  uint64_t finish(uint64_t content_hash) {
    const uint64_t length = bytes_ + kSectionHeaderBytes + kEndBytes;
    ByteWriter end;
    end.put(sections_);
    end.put(content_hash);
    end.put(hashOf(headers_.data(), headers_.size()));
    end.put(length);
    add(makePlainSection(kEnd, std::move(end.bytes)));
    file_.commit();
    return length;
  }

 private:
  void write(const Bytes& bytes) {
    file_.write(bytes.data(), bytes.size());
    bytes_ += bytes.size();
  }

  AtomicFile file_;
  Bytes headers_;  ///< All so far.
  uint64_t sections_ = 0, bytes_ = 0;
};

}  // namespace

static_assert(kBlocksPerMapChunk == map_format::kBlocksPerChunk, "one size of chunks");

SavedMap saveMap(const MapContents& contents, const std::string& path, int threads) {
  checkContents(contents);
  const ChunkBounds bounds = boundsOf(contents.blocks, kBlocksPerChunk);
  const MapWords words{
      [&](size_t chunk) { return contents.voxels.data() + bounds.voxel_word[chunk]; },
      [&](size_t chunk) { return contents.colours.data() + bounds.colour_word[chunk]; }};
  return saveMapInChunks(contents, words, path, threads);
}

SavedMap saveMapInChunks(const MapContents& head, const MapWords& words, const std::string& path,
                         int threads) {
  const MapSize size = sizeOf(head);
  const ChunkBounds bounds = boundsOf(head.blocks, kBlocksPerChunk);
  ContentHash hash(head, size);
  MapFileWriter file(path);
  file.add(makePlainSection(kSettings,
                            bytesOf(settingsText(settingsOfFile(head.settings, head.poses)))));
  file.add(makePlainSection(kFrame, bytesOf(head.map_frame)));
  if (head.T_W_M) {
    ByteWriter level;
    level.putPose(*head.T_W_M);
    file.add(makePlainSection(kLevel, std::move(level.bytes)));
  }
  file.add(makePlainSection(kState, encodeState(head, size)));
  file.add(makeCompressedSection(kBlocks, kRequired, encodeBlocks(head.blocks)));
  if (head.painted) {
    file.add(makeCompressedSection(kColourIndex, 0, encodeColourIndex(head)));
  }
  if (head.cell_voxels != 0) file.add(makeCompressedSection(kFree, 0, encodeFree(head)));
  const auto add = [&](size_t, const Section& section) { file.add(section); };
  makeInOrder(
      bounds.count(), threads,
      [&](size_t i) {
        const uint64_t* const voxels = words.voxels(i);
        hash.addVoxels(bounds, i, voxels);
        return makeChunk(kVoxels, kRequired, voxels, bounds.voxel_word, i);
      },
      add);
  if (head.painted) {
    makeInOrder(
        bounds.count(), threads,
        [&](size_t i) {
          const uint32_t* const colours = words.colours(i);
          hash.addColours(bounds, i, colours);
          return makeChunk(kColours, 0, colours, bounds.colour_word, i);
        },
        add);
  }
  SavedMap saved;
  saved.size = size;
  saved.content_hash = hash.result();
  saved.file_bytes = file.finish(saved.content_hash);
  return saved;
}

}  // namespace dtsdf
