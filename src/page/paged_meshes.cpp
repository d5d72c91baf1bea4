#include "page/paged_meshes.h"

#include <algorithm>
#include <utility>

#include "kernels/core/grid.h"
#include "map/memory_budget.h"

namespace dtsdf {
namespace {

/// What stays in memory: a share of the budget, beside it.
constexpr size_t kMeshShare = 8, kMostMeshBytes = size_t{64} << 20;

size_t meshBudgetOf(const MapParams& params) {
  if (params.page_folder.empty()) return 0;
  return std::min((static_cast<size_t>(params.max_memory_mb) << 20) / kMeshShare, kMostMeshBytes);
}

}  // namespace

PagedMeshes::PagedMeshes(const MapParams& params)
    : most_bytes_(meshBudgetOf(params)),
      pages_(params.page_folder.empty()
                 ? nullptr
                 : std::make_shared<PagedValues>(params.page_folder, pageBytesOf(params),
                                                 most_bytes_)),
      fetched_(params.voxel_size_m) {}

void PagedMeshes::put(const SharedBlockMesh& block) {
  const PackedKey key = packedKeyOf(block->key);
  forget(key);
  if (block->triangles.empty()) return;
  const Kept kept{Paged<BlockMesh>(block, pages_), bytesOf(*block), block->triangles.size() / 3,
                  !block->colours.empty()};
  meshes_.emplace(key, kept);
  bytes_ += kept.bytes;
  triangles_ += kept.triangles;
  painted_ += kept.is_painted ? 1 : 0;
}

void PagedMeshes::forget(PackedKey key) {
  const auto found = meshes_.find(key);
  if (found == meshes_.end()) return;
  bytes_ -= found->second.bytes;
  triangles_ -= found->second.triangles;
  painted_ -= found->second.is_painted ? 1 : 0;
  meshes_.erase(found);
}

SharedBlockMesh PagedMeshes::find(PackedKey key) {
  const auto found = meshes_.find(key);
  if (found == meshes_.end()) return nullptr;
  SharedBlockMesh mesh = found->second.mesh.peek();
  if (mesh == nullptr) ++missed_;
  return mesh;
}

const MeshStore& PagedMeshes::holding(const std::vector<PackedKey>& keys) {
  fetched_.clear();
  for (const PackedKey key : keys) {
    if (SharedBlockMesh block = find(key)) fetched_.put(std::move(block));
  }
  return fetched_;
}

void PagedMeshes::stream(const MeshStream::Sink& sink) {
  const std::vector<PackedKey> in_order = keys();
  BlockExtent bounds = noBlocks();
  for (const PackedKey key : in_order) bounds = around(bounds, {unpackKey(key), unpackKey(key)});
  MeshStream stream({voxelSize(), isPainted(), bounds}, sink);
  for (const PackedKey key : in_order) {
    if (const SharedBlockMesh block = find(key)) stream.add(*block);
  }
  stream.finish();
}

std::vector<PackedKey> PagedMeshes::keys() const {
  std::vector<PackedKey> all;
  all.reserve(meshes_.size());
  for (const auto& [key, kept] : meshes_) all.push_back(key);
  return all;
}

void PagedMeshes::clear(float voxel_size_m) {
  fetched_ = MeshStore(voxel_size_m);
  meshes_.clear();
  bytes_ = triangles_ = painted_ = missed_ = 0;
  if (pages_ != nullptr) pages_->resetCounts();
}

}  // namespace dtsdf
