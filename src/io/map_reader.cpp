// Maps from records: first what the small ones say, then sizes, then what there is room for.
#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

#include "io/map_chunks.h"
#include "io/map_format.h"
#include "params/printable.h"
#include "threads/parallel.h"

namespace dtsdf {

using namespace map_format;

namespace {

constexpr uint64_t kMostArrays = uint64_t{1} << 40;  // so that sizes in bytes fit 64 bits

/// Of a map that is sound, and more than is allowed.
struct TooLarge : std::runtime_error {
  using std::runtime_error::runtime_error;
};

bool isKnown(const Record& record) {
  static constexpr const char* kKnown[] = {kSettings,    kFrame, kLevel,  kBox,     kState, kBlocks,
                                           kColourIndex, kFree,  kVoxels, kColours, kEnd};
  return std::any_of(std::begin(kKnown), std::end(kKnown),
                     [&](const char* kind) { return record.is(kind); });
}

}  // namespace

struct MapChunks::State {
  State(std::shared_ptr<const RecordFile> opened, size_t first_record, const MapLimit& limited)
      : file(std::move(opened)), limit(limited), first(first_record) {
    findRecords();
    checkEnd();
    soundly([&] { readSettings(); });
    soundly([&] { readTables(); });
    bounds = boundsOf(head.blocks);
    if (voxels.size() != bounds.count() ||
        colours.size() != (head.painted ? bounds.count() : size_t{0})) {
      throwWrongSizes();
    }
    checkHash();
  }

  [[noreturn]] void throwWrongSizes() const { file->throwDamaged("its sizes are inconsistent"); }

  /// What is found to be wrong with the contents is wrong with the file.
  template <class Check>
  void soundly(const Check& check) const {
    std::string problem;
    try {
      return check();
    } catch (const TooLarge&) {
      throw;
    } catch (const std::exception& error) {
      problem = error.what();
    }
    if (problem.find(file->path()) != std::string::npos) throw std::runtime_error(problem);
    std::replace(problem.begin(), problem.end(), '\n', ' ');
    file->throwDamaged(problem);
  }

  void findRecords() {
    const std::vector<Record>& all = file->records();
    for (end = first; end < all.size(); ++end) {
      const Record& record = all[end];
      if (record.is(kVoxels)) voxels.push_back(record);
      if (record.is(kColours)) colours.push_back(record);
      if (!isKnown(record) && !(record.flags & kMayBeSkipped)) {
        throw std::runtime_error("the map file '" + file->path() + "' has a record " +
                                 printable(record.name()) +
                                 " that this program does not know; use a newer program");
      }
      if (record.is(kEnd)) return;
    }
    file->throwDamaged("its end is missing");
  }

  void checkEnd() {
    const size_t chunks = voxels.size() + colours.size();
    const Bytes bytes = file->read(file->records()[end], kEndBytes + chunks * sizeof(uint64_t));
    ByteReader in(bytes);
    const auto records = in.take<uint64_t>(), heads = in.take<uint64_t>();
    content_hash = in.take<uint64_t>();
    for (size_t i = 0; i < chunks; ++i) sums.push_back(in.take<uint64_t>());
    if (records != end - first || heads != file->headHash(first, end)) {
      file->throwDamaged("its records are not those that were written");
    }
  }

  /// Null if it is not there.
  const Record* find(const char* kind) const {
    const Record* found = nullptr;
    for (size_t i = first; i < end; ++i) {
      const Record& record = file->records()[i];
      if (!record.is(kind)) continue;
      if (found != nullptr) file->throwDamaged(std::string("it has more than one record ") + kind);
      found = &record;
    }
    return found;
  }

  const Record& get(const char* kind) const {
    const Record* const record = find(kind);
    if (record == nullptr) file->throwDamaged(std::string("the record ") + kind + " is missing");
    return *record;
  }

  void readSettings() {
    const Bytes settings = file->readAny(get(kSettings), kMostText);
    const Bytes frame = file->readAny(get(kFrame), kMostText);
    if (!parseSettings({settings.begin(), settings.end()}, head.settings)) {
      file->throwDamaged("its settings are malformed");
    }
    head.map_frame.assign(frame.begin(), frame.end());
    withSettingsOf(head, {});
    head.poses = posesOf(head.settings);
    if (const Record* const level = find(kLevel)) {
      head.T_W_M = ByteReader(file->read(*level, kPoseBytes)).takePose();
    }
    if (const Record* const box = find(kBox)) readBox(file->readAny(*box, kMostBox));
  }

  void readBox(const Bytes& bytes) {
    ByteReader in(bytes);
    MapBox box;
    box.first = in.takeKey();
    box.last = in.takeKey();
    box.recordings = in.take<uint64_t>();
    for (IndexRanges* const frames : {&box.fused, &box.supporting}) {
      const auto count = in.take<uint64_t>();
      if (count > in.left() / 16) throwWrongSizes();
      for (uint64_t i = 0; i < count; ++i) {
        const auto from = in.take<uint64_t>(), to = in.take<uint64_t>();
        if (to < from || (!frames->empty() && from <= frames->back().second)) throwWrongSizes();
        frames->emplace_back(from, to);
      }
    }
    of_box = std::move(box);
  }

  void readTables() {
    const Bytes state = file->read(get(kState), kStateBytes);
    ByteReader in(state);
    head.frames = in.take<uint64_t>();
    head.supporting_frames = in.take<uint64_t>();
    MapSize known;  // before what the blocks hold is read
    known.blocks = in.take<uint64_t>();
    known.voxel_arrays = in.take<uint64_t>();
    head.stamp_s = in.take<double>();
    if (known.voxel_arrays > kMostArrays || known.blocks > known.voxel_arrays) throwWrongSizes();
    checkRoom(known);
    readBlocks(known.blocks);
    readColourIndex();
    readFree(known);
    checkHead(head);
    size = sizeOf(head);
    if (size.voxel_arrays != known.voxel_arrays) throwWrongSizes();
    checkRoom(size);
  }

  void readBlocks(size_t count) {
    const Bytes bytes = file->read(get(kBlocks), count * kBlockBytes);
    ByteReader in(bytes);
    head.blocks.resize(count);
    for (MapBlock& block : head.blocks) {
      block.key = in.takeKey();
      block.directions = in.take<uint32_t>();
      block.bricks = 0;
    }
  }

  void readColourIndex() {
    const Record* const record = find(kColourIndex);
    head.painted = record != nullptr;
    if (record == nullptr) return;
    const Bytes bytes =
        file->read(*record, kColourHeadBytes + head.blocks.size() * kBlockBricksBytes);
    ByteReader in(bytes);
    for (float& gain : head.exposure) gain = in.take<float>();
    in.take<uint32_t>();
    for (MapBlock& block : head.blocks) block.bricks = in.take<uint64_t>();
  }

  void readFree(MapSize known) {
    const Record* const record = find(kFree);
    if (record == nullptr) return;
    const size_t most = std::min(limit.bytes, kNoMapLimit / 2);
    const Bytes content = file->readAny(*record, most + kFreeHeadBytes);
    ByteReader in(content);
    head.cell_voxels = in.take<int32_t>();
    in.take<uint32_t>();
    if (head.cell_voxels == 0 || in.left() % kFreeRecordBytes != 0) throwWrongSizes();
    known.free_cubes = in.left() / kFreeRecordBytes;
    checkRoom(known);
    head.free_cubes.resize(known.free_cubes);
    for (MapFreeCube& cube : head.free_cubes) {
      cube.key = in.takeKey();
      in.take<uint32_t>();
      for (uint64_t& word : cube.cells) word = in.take<uint64_t>();
    }
  }

  void checkRoom(const MapSize& taken) const {
    MapSize free, map = taken;
    free.free_cubes = std::exchange(map.free_cubes, 0);
    const size_t bytes = limit.adds_free ? taken.bytes() : std::max(map.bytes(), free.bytes());
    if (bytes <= limit.bytes) return;
    throw TooLarge("the map of '" + file->path() + "' takes " + std::to_string((bytes >> 20) + 1) +
                   " MiB, and " + std::to_string(limit.bytes >> 20) +
                   " MiB are allowed; raise map/max_memory_mb (map_tool: --max-memory-mb)");
  }

  /// What the file says of its voxels and colours, which their reading checks, makes the hash.
  void checkHash() const {
    ContentHash hash(head);
    for (const uint64_t sum : sums) hash.add(sum);
    if (hash.result() != content_hash) file->throwDamaged("the content hash does not match");
  }

  template <class Words>
  void readVoxels(size_t chunk, Words& words) const {
    read(voxels[chunk], bounds.voxel_word, chunk, sums[head.painted ? 2 * chunk : chunk], words);
  }
  template <class Words>
  void readColours(size_t chunk, Words& words) const {
    read(colours[chunk], bounds.colour_word, chunk, sums[2 * chunk + 1], words);
  }

  template <class Words>
  void read(const Record& record, const std::vector<size_t>& word, size_t chunk, uint64_t sum,
            Words& words) const {
    words = Words(word[chunk + 1] - word[chunk]);
    const size_t bytes = words.size() * sizeof(words[0]);
    file->read(record, words.data(), bytes);
    if (checksumOf(record.name().c_str(), words.data(), bytes) == sum) return;
    file->throwDamaged("the content of a record " + record.name() + " does not match its checksum");
  }

  MapContents part(size_t chunk) const {
    MapContents part;
    part.painted = head.painted;
    const auto block = [&](size_t at) {
      return head.blocks.begin() + static_cast<std::ptrdiff_t>(bounds.block[at]);
    };
    part.blocks.assign(block(chunk), block(chunk + 1));
    readVoxels(chunk, part.voxels);
    if (head.painted) readColours(chunk, part.colours);
    return part;
  }

  const std::shared_ptr<const RecordFile> file;
  const MapLimit limit;
  const size_t first;
  size_t end = 0;
  MapContents head;
  std::optional<MapBox> of_box;
  MapSize size;
  uint64_t content_hash = 0;
  ChunkBounds bounds;
  std::vector<uint64_t> sums;           // of voxels, and colours, of one chunk after the other
  std::vector<Record> voxels, colours;  // copies: a journal grows while its map is read
};

MapLimit limitOf(const MapperParams& params) {
  return {mostMapBytes(params), params.space.enabled};
}

MapChunks::MapChunks(const std::string& path, const MapLimit& limit)
    : MapChunks(std::make_shared<const RecordFile>(path, kPurpose, "map file"), 0, limit) {
  const RecordFile& file = *state_->file;
  if (file.end() == file.bytes() && endRecord() == file.records().size()) return;
  file.throwDamaged("there is data after its end");
}

MapChunks::MapChunks(const std::string& path, const MapperParams& params)
    : MapChunks(path, limitOf(params)) {}

MapChunks::MapChunks(std::shared_ptr<const RecordFile> file, size_t first, const MapLimit& limit)
    : state_(std::make_unique<State>(std::move(file), first, limit)) {}

MapChunks::~MapChunks() = default;
MapChunks::MapChunks(MapChunks&&) noexcept = default;

const std::string& MapChunks::path() const { return state_->file->path(); }
const MapContents& MapChunks::head() const { return state_->head; }
const std::optional<MapBox>& MapChunks::box() const { return state_->of_box; }
const MapSize& MapChunks::size() const { return state_->size; }
uint64_t MapChunks::contentHash() const { return state_->content_hash; }
size_t MapChunks::endRecord() const { return state_->end + 1; }
size_t MapChunks::count() const { return state_->bounds.count(); }

void MapChunks::readVoxels(size_t chunk, std::vector<uint64_t>& words) const {
  state_->readVoxels(chunk, words);
}

void MapChunks::readColours(size_t chunk, std::vector<uint32_t>& words) const {
  state_->readColours(chunk, words);
}

void MapChunks::visit(const std::function<void(const MapContents&)>& take, int threads) const {
  makeInOrder(
      count(), std::min(threadCount(threads), kMostChunksAtOnce),
      [this](size_t i) { return state_->part(i); },
      [&](size_t, const MapContents& part) { take(part); });
}

void MapChunks::verify() const {
  visit([](const MapContents&) {});
}

MapInfo MapChunks::info() const {
  MapInfo info;
  static_cast<MapHead&>(info) = state_->head;
  info.size = size();
  info.file_bytes = state_->file->bytes();
  info.content_hash = contentHash();
  const std::vector<MapBlock>& blocks = head().blocks;
  if (!blocks.empty()) info.least = info.most = blocks.front().key;
  for (const MapBlock& block : blocks) {
    info.least = leastOf(info.least, block.key);
    info.most = greatestOf(info.most, block.key);
  }
  for (size_t i = state_->first; i <= state_->end; ++i) {
    const Record& record = state_->file->records()[i];
    auto part = std::find_if(info.parts.begin(), info.parts.end(),
                             [&](const MapFilePart& p) { return p.kind == record.name(); });
    if (part == info.parts.end()) {
      part = info.parts.insert(part, {record.name(), isKnown(record)});
    }
    ++part->records;
    part->stored_bytes += record.stored_bytes;
  }
  return info;
}

MapParts partsOf(std::shared_ptr<const MapChunks> file) {
  MapParts parts;
  parts.head = std::shared_ptr<const MapContents>(file, &file->head());
  parts.visit = [file = std::move(file)](const auto& take) { file->visit(take); };
  return parts;
}

namespace {

MapContents loadAll(const MapChunks& file, int threads) {
  MapContents contents;
  static_cast<MapHead&>(contents) = file.head();
  contents.blocks = file.head().blocks;
  contents.free_cubes = file.head().free_cubes;
  const ChunkBounds bounds = boundsOf(contents.blocks);
  contents.voxels = PlainArray<uint64_t>(bounds.voxel_word.back());
  contents.colours = PlainArray<uint32_t>(bounds.colour_word.back());
  uint64_t* voxels = contents.voxels.data();
  uint32_t* colours = contents.colours.data();
  file.visit(
      [&](const MapContents& part) {
        voxels = std::copy_n(part.voxels.data(), part.voxels.size(), voxels);
        colours = std::copy_n(part.colours.data(), part.colours.size(), colours);
      },
      threads);
  return contents;
}

}  // namespace

MapContents loadMap(const std::string& path, size_t max_bytes, int threads) {
  return loadAll(MapChunks(path, MapLimit{max_bytes, true}), threads);
}

MapContents loadMap(const std::string& path, const MapperParams& params, int threads) {
  const MapLimit limit{static_cast<size_t>(params.map.max_memory_mb) << 20, params.space.enabled};
  return loadAll(MapChunks(path, limit), threads);
}

MapInfo readMapInfo(const std::string& path) { return MapChunks(path).info(); }

}  // namespace dtsdf
