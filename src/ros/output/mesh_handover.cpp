#include "ros/output/mesh_handover.h"

#include <memory>
#include <utility>

#include "kernels/core/grid.h"

namespace dtsdf {

MeshHandover::MeshHandover(std::function<void()> on_change) : on_change_(std::move(on_change)) {}

void MeshHandover::add(MeshUpdate update, const ros::Time& stamp) {
  if (update.blocks.empty()) return;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (BlockMesh& block : update.blocks) {
      const PackedKey key = packKey(block.key);
      blocks_[key] = std::make_shared<const BlockMesh>(std::move(block));
    }
    stamp_ = stamp;
  }
  on_change_();
}

void MeshHandover::replaceAll(std::map<PackedKey, BlockMesh> mesh, const ros::Time& stamp) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_whole_ = true;
    blocks_.clear();
    for (auto& [key, block] : mesh) {
      blocks_[key] = std::make_shared<const BlockMesh>(std::move(block));
    }
    stamp_ = stamp;
  }
  on_change_();
}

void MeshHandover::clear(std::optional<float> voxel_size_m) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    cleared_ = true;
    is_whole_ = false;
    if (voxel_size_m) voxel_size_m_ = voxel_size_m;
    blocks_.clear();
    stamp_ = ros::Time();
  }
  on_change_();
}

MeshChanges MeshHandover::take() {
  decltype(blocks_) blocks;
  MeshChanges changes;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    changes.cleared = std::exchange(cleared_, false);
    changes.is_whole = std::exchange(is_whole_, false);
    changes.voxel_size_m = std::exchange(voxel_size_m_, std::nullopt);
    changes.stamp = std::exchange(stamp_, ros::Time());
    blocks.swap(blocks_);
  }
  changes.blocks.reserve(blocks.size());
  for (auto& [key, block] : blocks) changes.blocks.push_back(std::move(block));
  return changes;
}

}  // namespace dtsdf
