// Reads maps from records: first the small records, which determine the sizes of all other records,
// then voxels and colours.
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dtsdf_mapping/io/yaml_params.h"
#include "io/map_chunks.h"
#include "io/map_format.h"
#include "params/printable.h"
#include "threads/parallel.h"

namespace dtsdf {

using namespace map_format;

namespace {

bool isKnown(const Record& record) {
  static constexpr const char* kKnown[] = {kSettings,    kFrame, kLevel,  kBox,     kState, kBlocks,
                                           kColourIndex, kFree,  kVoxels, kColours, kEnd};
  return std::any_of(std::begin(kKnown), std::end(kKnown),
                     [&](const char* kind) { return record.is(kind); });
}

}  // namespace

MapChunks::MapChunks(std::shared_ptr<const RecordFile> file, size_t first, size_t max_bytes)
    : file_(std::move(file)), max_bytes_(max_bytes), first_(first) {
  findRecords();
  reportingDamage([&] {
    checkEnd();
    readSettings();
    readTables();
  });
  // The hash uses the stored checksums of voxels and colours; part() verifies those checksums.
  if (contentHashOf(head_, sums_) != content_hash_) {
    file_->throwDamaged("the content hash does not match");
  }
}

/// Reports errors in the contents as damage to the file, unless the error message already names the
/// file.
template <class Check>
void MapChunks::reportingDamage(const Check& check) const {
  std::string problem;
  try {
    return check();
  } catch (const std::exception& error) {
    problem = error.what();
  }
  if (problem.find(file_->path()) != std::string::npos) throw std::runtime_error(problem);
  std::replace(problem.begin(), problem.end(), '\n', ' ');
  file_->throwDamaged(problem);
}

void MapChunks::findRecords() {
  const std::vector<Record>& all = file_->records();
  for (end_ = first_; end_ < all.size(); ++end_) {
    const Record& record = all[end_];
    if (record.is(kVoxels)) voxels_.push_back(record);
    if (record.is(kColours)) colours_.push_back(record);
    if (!isKnown(record) && !(record.flags & kMayBeSkipped)) {
      throw std::runtime_error("the map file '" + file_->path() +
                               "' has a record of an unknown kind, " + printable(record.name()) +
                               "; use a newer version of dtsdf_mapping");
    }
    if (record.is(kEnd)) return;
  }
  file_->throwDamaged("its end is missing");
}

void MapChunks::checkEnd() {
  uint64_t records = 0, heads = 0;
  file_->visit(file_->records()[end_], kMaxRecords * sizeof(uint64_t), [&](ByteReader& in) {
    in(records, heads, content_hash_);
    in.rest(sums_);
  });
  if (records != end_ - first_ || heads != file_->headHash(first_, end_)) {
    file_->throwDamaged("its records do not match its end record");
  }
}

/// The map's record of this kind, or null. @throws std::runtime_error if there are several.
const Record* MapChunks::find(const char* kind) const {
  const Record* found = nullptr;
  for (size_t i = first_; i < end_; ++i) {
    const Record& record = file_->records()[i];
    if (!record.is(kind)) continue;
    if (found != nullptr)
      file_->throwDamaged(std::string("it has more than one record of kind ") + kind);
    found = &record;
  }
  return found;
}

const Record& MapChunks::get(const char* kind) const {
  const Record* const record = find(kind);
  if (record == nullptr)
    file_->throwDamaged(std::string("the record of kind ") + kind + " is missing");
  return *record;
}

void MapChunks::readSettings() {
  const Bytes settings = file_->read(get(kSettings), kMaxText);
  const Bytes frame = file_->read(get(kFrame), kMaxText);
  head_.settings = parseYamlParams({settings.begin(), settings.end()}, "its settings");
  head_.map_frame.assign(frame.begin(), frame.end());
  withSettingsOf(head_, {});
  head_.poses = posesOf(head_.settings);
  if (const Record* const level = find(kLevel)) {
    file_->visit(*level, kPoseBytes, [&](ByteReader& in) { in(head_.T_W_M.emplace()); });
  }
  if (const Record* const box = find(kBox)) {
    file_->visit(*box, kMaxBox, [&](ByteReader& in) { in(box_.emplace()); });
  }
}

void MapChunks::readTables() {
  MapSize stated;
  file_->visit(get(kState), kMaxText, [&](ByteReader& in) { visitState(in, head_, stated); });
  head_.painted = find(kColourIndex) != nullptr;
  const size_t most = std::min(max_bytes_, kNoMapLimit / 2) + kMaxText;
  visitTables(head_, [&](const char* kind, bool, const auto& content) {
    if (const Record* const record = find(kind)) file_->visit(*record, most, content);
    checkRoom(sizeOf(head_));
  });
  checkHead(head_);
  size_ = sizeOf(head_);
  const size_t chunks = chunkCount(head_.blocks);
  if (size_.blocks != stated.blocks || size_.voxel_arrays != stated.voxel_arrays ||
      voxels_.size() != chunks || colours_.size() != (head_.painted ? chunks : 0) ||
      sums_.size() != voxels_.size() + colours_.size()) {
    file_->throwDamaged("its sizes are inconsistent");
  }
}

void MapChunks::checkRoom(const MapSize& taken) const {
  if (taken.bytes() <= max_bytes_) return;
  throw std::runtime_error("the map in '" + file_->path() + "' needs " +
                           std::to_string((taken.bytes() >> 20) + 1) + " MiB, but only " +
                           std::to_string(max_bytes_ >> 20) +
                           " MiB are allowed; raise map/max_memory_mb");
}

template <class Word>
void MapChunks::readWords(const Record& record, uint64_t sum, size_t count,
                          PlainArray<Word>& words) const {
  words = PlainArray<Word>(count);
  const size_t bytes = count * sizeof(Word);
  file_->read(record, words.data(), bytes);
  if (checksumOf(record.name().c_str(), words.data(), bytes) == sum) return;
  file_->throwDamaged("the content of a " + record.name() + " record does not match its checksum");
}

MapChunks::MapChunks(const std::string& path, size_t max_bytes)
    : MapChunks(std::make_shared<const RecordFile>(path, kPurpose, "map file"), 0, max_bytes) {
  if (file_->end() == file_->bytes() && endRecord() == file_->records().size()) return;
  file_->throwDamaged("there is data after its end");
}

MapChunks::MapChunks(const std::string& path, const MapperParams& params)
    : MapChunks(path, maxMapBytes(params)) {}

MapContents MapChunks::part(size_t chunk) const {
  MapContents part;
  part.painted = head().painted;
  part.blocks = blocksOfChunk(head().blocks, chunk);
  const MapSize size = sizeOf(part.blocks);
  readWords(voxels_[chunk], sums_[part.painted ? 2 * chunk : chunk],
            size.voxel_arrays * kArrayWords, part.voxels);
  if (part.painted) {
    readWords(colours_[chunk], sums_[2 * chunk + 1], size.bricks * kBrickWords, part.colours);
  }
  return part;
}

void MapChunks::visit(const std::function<void(const MapContents&)>& take, int threads) const {
  makeInOrder(
      voxels_.size(), std::min(threadCount(threads), kMaxChunksAtOnce),
      [this](size_t i) { return part(i); }, [&](size_t, const MapContents& part) { take(part); });
}

MapInfo MapChunks::info() const {
  MapInfo info = infoOf(head_);
  info.file_bytes = file_->bytes();
  info.content_hash = contentHash();
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
  return loadAll(MapChunks(path, max_bytes), threads);
}

MapContents loadMap(const std::string& path, const MapperParams& params, int threads) {
  return loadAll(MapChunks(path, params), threads);
}

MapInfo readMapInfo(const std::string& path) { return MapChunks(path).info(); }

}  // namespace dtsdf
