#include "page/paged_meshes.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>

#include "kernels/core/grid.h"
#include "map/memory_budget.h"
#include "map/mesh_bytes.h"

namespace dtsdf {
namespace {

/// What stays in memory: a share of the budget, beside it.
constexpr size_t kMeshShare = 8, kMostMeshBytes = size_t{64} << 20;

/// Of that, what is on its way to the disk: the rest is for those that stay, and for one more
/// batch.
constexpr size_t kMeshesWaitingShare = 10;

size_t meshBudgetOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return std::min((static_cast<size_t>(params.max_memory_mb) << 20) / kMeshShare, kMostMeshBytes);
}

SharedPagedValues pagesOf(const MapParams& params) {
  if (params.page_folder.empty()) return nullptr;
  const size_t waiting_bytes = meshBudgetOf(params) / kMeshesWaitingShare;
  return std::make_shared<PagedValues>(params.page_folder, pageBytesOf(params),
                                       meshBudgetOf(params) - 2 * waiting_bytes, "meshes",
                                       std::min(waiting_bytes, PagedValues::kBytesAtOnce));
}

/// What a record begins with.
struct RecordHead {
  PackedKey key;
  uint32_t vertices, indices, colours;
};

template <class T>
void append(const std::vector<T>& from, char*& to) {
  if (!from.empty()) std::memcpy(to, from.data(), from.size() * sizeof(T));
  to += from.size() * sizeof(T);
}

template <class T>
void take(size_t count, const char*& from, std::vector<T>& to) {
  to.resize(count);
  if (count > 0) std::memcpy(to.data(), from, count * sizeof(T));
  from += count * sizeof(T);
}

}  // namespace

size_t PagedMesh::bytes() const { return bytesOf(*mesh); }

size_t PagedMesh::recordBytes() const {
  return sizeof(RecordHead) + bytesOf(*mesh) - sizeof(BlockMesh);
}

void PagedMesh::writeTo(char* record) const {
  const RecordHead head{packKey(mesh->key), static_cast<uint32_t>(mesh->vertices.size()),
                        static_cast<uint32_t>(mesh->triangles.size()),
                        static_cast<uint32_t>(mesh->colours.size())};
  std::memcpy(record, &head, sizeof(head));
  record += sizeof(head);
  append(mesh->vertices, record);
  append(mesh->triangles, record);
  append(mesh->colours, record);
}

PagedMesh PagedMesh::readFrom(const char* record) {
  RecordHead head;
  std::memcpy(&head, record, sizeof(head));
  record += sizeof(head);
  auto mesh = std::make_shared<BlockMesh>();
  mesh->key = unpackKey(head.key);
  take(head.vertices, record, mesh->vertices);
  take(head.indices, record, mesh->triangles);
  take(head.colours, record, mesh->colours);
  return {std::move(mesh)};
}

PagedMeshes::PagedMeshes(const MapParams& params)
    : most_bytes_(meshBudgetOf(params)), pages_(pagesOf(params)), store_(params.voxel_size_m) {}

void PagedMeshes::put(const SharedBlockMesh& block) {
  const PackedKey key = packedKeyOf(block->key);
  if (const auto before = items_.find(key); before != items_.end()) erase(before);
  if (!pages_) store_.put(block);
  if (block->triangles.empty()) return;
  Item item{{}, bytesOf(*block), block->triangles.size() / 3, !block->colours.empty()};
  if (pages_) item.mesh = {std::make_shared<const PagedMesh>(PagedMesh{block}), pages_};
  bytes_ += item.bytes;
  triangles_ += item.triangles;
  painted_ += item.is_painted ? 1 : 0;
  items_.emplace(key, std::move(item));
}

void PagedMeshes::erase(Items::iterator item) {
  bytes_ -= item->second.bytes;
  triangles_ -= item->second.triangles;
  painted_ -= item->second.is_painted ? 1 : 0;
  items_.erase(item);
}

SharedBlockMesh PagedMeshes::find(PackedKey key) {
  if (!pages_) {
    const auto found = store_.blocks().find(key);
    return found == store_.blocks().end() ? nullptr : found->second;
  }
  const auto item = items_.find(key);
  if (item == items_.end()) return nullptr;
  if (const auto value = item->second.mesh.get()) return value->mesh;
  if (item->second.mesh.isLost()) erase(item);
  return nullptr;
}

const MeshStore& PagedMeshes::holding(const std::vector<PackedKey>& keys) {
  if (!pages_) return store_;
  store_.clear();
  for (const PackedKey key : keys) {
    if (SharedBlockMesh block = find(key)) store_.put(std::move(block));
  }
  return store_;
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
  std::vector<PackedKey> keys;
  keys.reserve(items_.size());
  for (const auto& [key, item] : items_) keys.push_back(key);
  return keys;
}

void PagedMeshes::clear(float voxel_size_m) {
  items_.clear();
  bytes_ = triangles_ = painted_ = 0;
  store_ = MeshStore(voxel_size_m);
  if (pages_) pages_->resetCounts();
}

}  // namespace dtsdf
