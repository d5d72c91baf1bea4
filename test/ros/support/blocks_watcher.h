/// The mesh as received by a subscriber to mesh_blocks.
#pragma once

#include <dtsdf_mapping/MeshBlocks.h>
#include <ros/node_handle.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "meshing/packed_chunk.h"

namespace dtsdf {

/// The mesh described by all messages received so far.
class BlocksState {
 public:
  void take(const dtsdf_mapping::MeshBlocks& message);

  const std::map<std::array<int64_t, 3>, PackedChunk>& chunks() const { return chunks_; }
  size_t triangles() const;
  /// Positions of the corners of all triangles, sorted.
  std::vector<std::array<double, 3>> corners() const;
  const std::string& frame() const { return frame_; }
  double stepM() const { return step_m_; }
  size_t addedChunks() const { return added_; }

 private:
  std::map<std::array<int64_t, 3>, PackedChunk> chunks_;
  std::string frame_;
  double step_m_ = 0.0;
  size_t added_ = 0;
};

class BlocksWatcher {
 public:
  explicit BlocksWatcher(ros::NodeHandle nh);
  const BlocksState& state() const { return state_; }

 private:
  BlocksState state_;
  ros::Subscriber subscriber_;
};

}  // namespace dtsdf
