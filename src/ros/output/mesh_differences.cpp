#include "ros/output/mesh_differences.h"

#include <cstring>
#include <memory>
#include <unordered_set>
#include <utility>

namespace dtsdf {
namespace {

template <class T>
bool isSame(const std::vector<T>& a, const std::vector<T>& b) {
  static_assert(std::has_unique_object_representations_v<T> || sizeof(T) == 16, "no padding");
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool isSame(const BlockMesh& a, const BlockMesh& b) {
  return isSame(a.vertices, b.vertices) && isSame(a.triangles, b.triangles) &&
         isSame(a.colours, b.colours);
}

}  // namespace

std::vector<SharedBlockMesh> differences(const MeshStore& store,
                                         std::vector<SharedBlockMesh> mesh) {
  std::vector<SharedBlockMesh> differing;
  std::unordered_set<PackedKey> kept;
  for (SharedBlockMesh& block : mesh) {
    const PackedKey key = packedKeyOf(block->key);
    kept.insert(key);
    const auto before = store.blocks().find(key);
    const bool is_shown = before != store.blocks().end();
    const bool is_same = is_shown ? isSame(*before->second, *block) : block->triangles.empty();
    if (!is_same) differing.push_back(std::move(block));
  }
  for (const auto& [key, block] : store.blocks()) {
    if (kept.count(key) > 0) continue;
    auto gone = std::make_shared<BlockMesh>();
    gone->key = block->key;
    differing.push_back(std::move(gone));
  }
  return differing;
}

}  // namespace dtsdf
