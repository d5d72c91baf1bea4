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
    const size_t chunks = chunkCount(head.blocks);
    if (voxels.size() != chunks || colours.size() != (head.painted ? chunks : 0)) {
      throwWrongSizes();
    }
    // What the file says of its voxels and colours, which their reading checks, makes the hash.
    if (contentHashOf(head, sums) != content_hash) {
      file->throwDamaged("the content hash does not match");
    }
  }

  [[noreturn]] void throwWrongSizes() const { file->throwDamaged("its sizes are inconsistent"); }

  /// What is found to be wrong with the contents is wrong with the file.
  template <class Check>
  void soundly(const Check& check) const {
    std::string problem;
    try {
      return check();
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
      head.T_W_M = ByteReader(file->read(*level, kPoseBytes)).take<Eigen::Isometry3d>();
    }
    if (const Record* const box = find(kBox)) {
      of_box = ByteReader(file->readAny(*box, kMostBox)).take<MapBox>();
    }
  }

  void readTables() {
    const Bytes state = file->read(get(kState), kStateBytes);
    ByteReader in(state);
    MapSize known;  // before what the blocks hold is read
    visitState(in, head, known);
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
    visitBlocks(in, head.blocks);
  }

  void readColourIndex() {
    const Record* const record = find(kColourIndex);
    head.painted = record != nullptr;
    if (record == nullptr) return;
    const Bytes bytes =
        file->read(*record, kColourHeadBytes + head.blocks.size() * kBlockBricksBytes);
    ByteReader in(bytes);
    visitColourIndex(in, head);
  }

  void readFree(MapSize known) {
    const Record* const record = find(kFree);
    if (record == nullptr) return;
    const size_t most = std::min(limit.bytes, kNoMapLimit / 2);
    const Bytes content = file->readAny(*record, most + kFreeHeadBytes);
    if (content.size() % kFreeRecordBytes != kFreeHeadBytes) throwWrongSizes();
    known.free_cubes = content.size() / kFreeRecordBytes;
    checkRoom(known);
    head.free_cubes.resize(known.free_cubes);
    ByteReader in(content);
    visitFree(in, head);
    if (head.cell_voxels == 0) throwWrongSizes();
  }

  void checkRoom(const MapSize& taken) const {
    MapSize free, map = taken;
    free.free_cubes = std::exchange(map.free_cubes, 0);
    const size_t bytes = limit.adds_free ? taken.bytes() : std::max(map.bytes(), free.bytes());
    if (bytes <= limit.bytes) return;
    throw std::runtime_error(
        "the map of '" + file->path() + "' takes " + std::to_string((bytes >> 20) + 1) +
        " MiB, and " + std::to_string(limit.bytes >> 20) +
        " MiB are allowed; raise map/max_memory_mb (map_tool: --max-memory-mb)");
  }

  template <class Word>
  void read(const Record& record, uint64_t sum, size_t count, PlainArray<Word>& words) const {
    words = PlainArray<Word>(count);
    const size_t bytes = count * sizeof(Word);
    file->read(record, words.data(), bytes);
    if (checksumOf(record.name().c_str(), words.data(), bytes) == sum) return;
    file->throwDamaged("the content of a record " + record.name() + " does not match its checksum");
  }

  const std::shared_ptr<const RecordFile> file;
  const MapLimit limit;
  const size_t first;
  size_t end = 0;
  MapContents head;
  std::optional<MapBox> of_box;
  MapSize size;
  uint64_t content_hash = 0;
  std::vector<uint64_t> sums;           // of voxels, and colours, of one chunk after the other
  std::vector<Record> voxels, colours;  // copies: a journal grows while its map is read
};

MapChunks::MapChunks(const std::string& path, const MapLimit& limit)
    : MapChunks(std::make_shared<const RecordFile>(path, kPurpose, "map file"), 0, limit) {
  const RecordFile& file = *state_->file;
  if (file.end() == file.bytes() && endRecord() == file.records().size()) return;
  file.throwDamaged("there is data after its end");
}

MapChunks::MapChunks(const std::string& path, const MapperParams& params)
    : MapChunks(path, MapLimit{mostMapBytes(params), params.space.enabled}) {}

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

MapContents MapChunks::part(size_t chunk) const {
  const std::vector<uint64_t>& sums = state_->sums;
  MapContents part;
  part.painted = head().painted;
  part.blocks = blocksOfChunk(head().blocks, chunk);
  const MapSize size = sizeOf(part.blocks);
  state_->read(state_->voxels[chunk], sums[part.painted ? 2 * chunk : chunk],
               size.voxel_arrays * kArrayWords, part.voxels);
  if (part.painted) {
    state_->read(state_->colours[chunk], sums[2 * chunk + 1], size.bricks * kBrickWords,
                 part.colours);
  }
  return part;
}

void MapChunks::visit(const std::function<void(const MapContents&)>& take, int threads) const {
  makeInOrder(
      state_->voxels.size(), std::min(threadCount(threads), kMostChunksAtOnce),
      [this](size_t i) { return part(i); }, [&](size_t, const MapContents& part) { take(part); });
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
  contents.voxels = PlainArray<uint64_t>(file.size().voxel_arrays * kArrayWords);
  contents.colours = PlainArray<uint32_t>(file.size().bricks * kBrickWords);
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
  return loadAll(MapChunks(path, params), threads);
}

MapInfo readMapInfo(const std::string& path) { return MapChunks(path).info(); }

}  // namespace dtsdf
