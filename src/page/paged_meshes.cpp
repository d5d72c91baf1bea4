#include "page/paged_meshes.h"

#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

#include "kernels/core/grid.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

/// Of the file.
constexpr uint64_t kMeshUnitBytes = 256;

/// What stays in memory: a share of the budget, beside it.
constexpr size_t kMeshShare = 8, kMostMeshBytes = size_t{64} << 20;

/// Not each mesh that comes has to make room.
constexpr size_t kSpareShare = 8;

/// A node of the index, with what the system adds.
constexpr size_t kNodeBytes = 80;

constexpr const char* kMeshesAreFull =
    "meshes in map/page_folder have reached map/page_max_gb; raise it";

size_t meshBudgetOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return std::min((static_cast<size_t>(params.max_memory_mb) << 20) / kMeshShare, kMostMeshBytes);
}

template <class T>
void append(const std::vector<T>& from, std::vector<char>& to) {
  const auto* const bytes = reinterpret_cast<const char*>(from.data());
  to.insert(to.end(), bytes, bytes + from.size() * sizeof(T));
}

template <class T>
void take(size_t count, const char*& from, std::vector<T>& to) {
  to.resize(count);
  if (count > 0) std::memcpy(to.data(), from, count * sizeof(T));
  from += count * sizeof(T);
}

}  // namespace

PagedMeshes::PagedMeshes(const MapParams& params)
    : max_file_bytes_(pageBytesOf(params)),
      most_bytes_(meshBudgetOf(params)),
      file_(params.page_folder.empty() ? nullptr : std::make_unique<PageFile>(params.page_folder)),
      resident_(params.voxel_size_m),
      runs_(std::min<uint64_t>(max_file_bytes_ / kMeshUnitBytes, UINT32_MAX)),
      fetched_(params.voxel_size_m) {}

size_t PagedMeshes::recordBytes(const Page& page) {
  return page.vertices * (sizeof(BlockVertex) + (page.has_colours ? sizeof(VertexColour) : 0)) +
         page.indices * sizeof(uint16_t);
}

uint64_t PagedMeshes::unitsOf(const Page& page) {
  return (recordBytes(page) + kMeshUnitBytes - 1) / kMeshUnitBytes;
}

void PagedMeshes::put(const SharedBlockMesh& block) {
  const PackedKey key = packedKeyOf(block->key);
  leaveDisk(key);
  leaveMemory(key);
  if (block->triangles.empty()) return;
  resident_.put(block);
  bytes_ += bytesOf(*block);
  painted_ += block->colours.empty() ? 0 : 1;
  if (file_) places_[key] = order_.insert(order_.end(), key);
  makeRoom();
}

void PagedMeshes::leaveMemory(PackedKey key) {
  const auto found = resident_.blocks().find(key);
  if (found == resident_.blocks().end()) return;
  const SharedBlockMesh block = found->second;
  auto none = std::make_shared<BlockMesh>();
  none->key = block->key;
  resident_.put(std::move(none));
  bytes_ -= bytesOf(*block);
  painted_ -= block->colours.empty() ? 0 : 1;
  const auto place = places_.find(key);
  if (place == places_.end()) return;
  order_.erase(place->second);
  places_.erase(place);
}

void PagedMeshes::leaveDisk(PackedKey key) {
  const auto found = pages_.find(key);
  if (found == pages_.end()) return;
  const Page page = found->second;
  const uint64_t end = runs_.end();
  runs_.give(page.first_unit, unitsOf(page));
  pages_.erase(found);
  paged_triangles_ -= page.indices / 3;
  painted_ -= page.has_colours ? 1 : 0;
  if (runs_.end() < end) file_->truncate(runs_.end() * kMeshUnitBytes);
}

/// Those that changed longest ago go.
void PagedMeshes::makeRoom() {
  if (!file_ || bytes_ <= most_bytes_) return;
  while (bytes_ > most_bytes_ - most_bytes_ / kSpareShare && !order_.empty()) {
    const PackedKey key = order_.front();
    const auto found = resident_.blocks().find(key);
    if (found == resident_.blocks().end()) {  // memory lacked when it was put
      places_.erase(key);
      order_.pop_front();
      continue;
    }
    if (!writeOut(*found->second)) return;
    leaveMemory(key);
  }
}

/// @return whether it did; it is in memory still.
bool PagedMeshes::writeOut(const BlockMesh& block) {
  std::vector<char> record;
  record.reserve(bytesOf(block));
  append(block.vertices, record);
  append(block.triangles, record);
  append(block.colours, record);
  Page page{XXH3_64bits(record.data(), record.size()), 0,
            static_cast<uint32_t>(block.vertices.size()),
            static_cast<uint32_t>(block.triangles.size()), !block.colours.empty()};
  leaveDisk(packedKeyOf(block.key));  // memory lacked when it was to leave for there
  const auto first = runs_.take(unitsOf(page));
  if (!first) return fail(kMeshesAreFull);
  page.first_unit = static_cast<uint32_t>(*first);
  const std::string problem = file_->write(*first * kMeshUnitBytes, record.data(), record.size());
  if (!problem.empty()) {
    runs_.give(*first, unitsOf(page));
    return fail(problem);
  }
  pages_.emplace(packedKeyOf(block.key), page);
  paged_triangles_ += page.indices / 3;
  painted_ += page.has_colours ? 1 : 0;
  return true;
}

bool PagedMeshes::fail(const std::string& problem) {
  stats_.problem = problem;
  ++stats_.failures;
  return false;
}

SharedBlockMesh PagedMeshes::find(PackedKey key) {
  const auto found = resident_.blocks().find(key);
  if (found != resident_.blocks().end()) return found->second;
  const auto page = pages_.find(key);
  return page == pages_.end() ? nullptr : read(key, page->second);
}

/// One that is damaged is there no longer.
SharedBlockMesh PagedMeshes::read(PackedKey key, const Page& page) {
  std::vector<char> record(recordBytes(page));
  bool is_short = false;
  const std::string problem =
      file_->read(page.first_unit * kMeshUnitBytes, record.data(), record.size(), is_short);
  if (!problem.empty() && !is_short) {
    fail(problem);
    return nullptr;
  }
  if (is_short || XXH3_64bits(record.data(), record.size()) != page.checksum) {
    stats_.problem = "what was read from map/page_folder is damaged; check the disk";
    ++stats_.lost;
    leaveDisk(key);
    return nullptr;
  }
  auto block = std::make_shared<BlockMesh>();
  block->key = unpackKey(key);
  const char* from = record.data();
  take(page.vertices, from, block->vertices);
  take(page.indices, from, block->triangles);
  take(page.has_colours ? page.vertices : 0, from, block->colours);
  return block;
}

const MeshStore& PagedMeshes::holding(const std::vector<PackedKey>& keys) {
  if (pages_.empty()) return resident_;
  fetched_.clear();
  for (const PackedKey key : keys) {
    if (SharedBlockMesh block = find(key)) fetched_.put(std::move(block));
  }
  return fetched_;
}

void PagedMeshes::stream(const MeshStream::Sink& sink) {
  const std::vector<PackedKey> in_order = keys();
  BlockBounds bounds;
  for (const PackedKey key : in_order) bounds.add(unpackKey(key));
  MeshStream stream({voxelSize(), isPainted(), bounds}, sink);
  for (const PackedKey key : in_order) {
    if (const SharedBlockMesh block = find(key)) stream.add(*block);
  }
  stream.finish();
}

std::vector<PackedKey> PagedMeshes::keys() const {
  std::vector<PackedKey> in_memory, on_disk, all;
  for (const auto& [key, block] : resident_.blocks()) in_memory.push_back(key);
  for (const auto& [key, page] : pages_) on_disk.push_back(key);
  std::set_union(in_memory.begin(), in_memory.end(), on_disk.begin(), on_disk.end(),
                 std::back_inserter(all));
  return all;
}

void PagedMeshes::clear(float voxel_size_m) {
  resident_ = MeshStore(voxel_size_m);
  fetched_ = MeshStore(voxel_size_m);
  order_.clear();
  places_.clear();
  pages_.clear();
  bytes_ = paged_triangles_ = painted_ = 0;
  stats_ = Stats();
  runs_.clear();
  if (file_) file_->truncate(0);
}

PagedMeshes::Stats PagedMeshes::stats() const {
  Stats stats = stats_;
  stats.bytes = runs_.inUse() * kMeshUnitBytes;
  stats.index_bytes = pages_.size() * kNodeBytes + runs_.bytes();
  return stats;
}

}  // namespace dtsdf
