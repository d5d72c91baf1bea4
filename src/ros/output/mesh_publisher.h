/// Publishes the mesh in chunks, as markers and as blocks: to a newcomer everything, then what
/// changed.
#pragma once

#include <ros/node_handle.h>

#include <string>
#include <vector>

#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "page/paged_meshes.h"
#include "ros/output/chunk_topic.h"

namespace dtsdf {

/// Output's thread only, but for hasListeners() and listeners().
class MeshPublisher {
 public:
  struct Style {
    std::string map_frame;
    MeshColour colour = MeshColour::kAuto;  ///< Of the markers.
    int chunk_blocks = 4;
  };

  MeshPublisher(const ros::NodeHandle& nh, const Style& style);

  bool hasListeners() const { return listeners() > 0; }
  size_t listeners() const { return markers_.listeners() + blocks_.listeners(); }

  /// Someone listens who does not know yet that chunks have changed.
  bool hasChanges() const { return hasListeners() && !chunks_.changed().empty(); }

  /// A listener lacks chunks that it knows of, and has room for them.
  bool isBehind(const QueueShare& share) const;

  void noteChange(const BlockKey& block) { chunks_.markChanged(block); }
  void noteCleared() { chunks_.markAllChanged(); }

  /// Takes note of who came and went.
  void meetNewcomers();

  /// Lets everyone have what changed.
  void publishChanges(PagedMeshes& meshes, const ros::Time& stamp, const QueueShare& share);

  /// Sends what listeners lack and have room for.
  void catchUp(PagedMeshes& meshes, const ros::Time& stamp, const QueueShare& share);

  std::vector<TopicReport> report() const { return {markers_.report(), blocks_.report()}; }

 private:
  void spreadChanges();

  const int chunk_blocks_;
  MeshChunks chunks_;
  ChunkTopic markers_, blocks_;
};

}  // namespace dtsdf
