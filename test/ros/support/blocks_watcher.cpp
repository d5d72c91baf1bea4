#include "ros/support/blocks_watcher.h"

#include <algorithm>

#include "ros/common/chunk_message.h"

namespace dtsdf {

using dtsdf_mapping::MeshBlock;
using dtsdf_mapping::MeshBlocks;

void BlocksState::take(const MeshBlocks& message) {
  frame_ = message.header.frame_id;
  step_m_ = message.step_m;
  if (message.begins_anew) chunks_.clear();
  for (const MeshBlock& block : message.blocks) {
    PackedChunk chunk = toChunk(block);
    if (chunk.triangleCount() == 0) {
      chunks_.erase(chunk.origin);
    } else {
      chunks_[chunk.origin] = chunk;
      ++added_;
    }
  }
}

size_t BlocksState::triangles() const {
  size_t count = 0;
  for (const auto& [origin, chunk] : chunks_) count += chunk.triangleCount();
  return count;
}

std::vector<std::array<double, 3>> BlocksState::corners() const {
  std::vector<std::array<double, 3>> corners;
  for (const auto& [origin, chunk] : chunks_) {
    for (size_t i = 0; i < 3 * chunk.triangleCount(); ++i) {
      corners.push_back(positionOf(chunk, step_m_, chunk.corner(i)));
    }
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

BlocksWatcher::BlocksWatcher(ros::NodeHandle nh)
    : subscriber_(nh.subscribe<MeshBlocks>(
          "/mapping/mesh_blocks", 1000,
          [this](const MeshBlocks::ConstPtr& message) { state_.take(*message); })) {}

}  // namespace dtsdf
