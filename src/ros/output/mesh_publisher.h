/// Publishes the mesh in chunks, as markers for every viewer and as blocks for little bandwidth: to
/// each listener what it lacks, in messages of bounded size, as fast as it reads.
#pragma once

#include <ros/node_handle.h>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "page/paged_meshes.h"
#include "ros/output/chunk_writer.h"
#include "ros/output/listener_topic.h"

namespace dtsdf {

/// Output's thread only, but for listeners(). A chunk is written when it is sent, so that a
/// listener gets the newest state of what it lacks, and nothing is written that nobody has room
/// for.
class ChunkTopic {
 public:
  /// Where chunks come from while listeners are served.
  struct Source {
    const MeshChunks& chunks;
    /// Of a chunk; nothing where some of it cannot be read now.
    std::function<std::optional<PackedChunk>(PackedKey)> pack;
    double step_m;    ///< Of the lattice that packed chunks lie on.
    ros::Time stamp;  ///< Of the newest frame in the mesh.
  };

  ChunkTopic(const ros::NodeHandle& nh, std::unique_ptr<ChunkWriter> writer);

  size_t listeners() const { return topic_.listeners(); }

  /// Takes note of who came and went. Newcomers lack all chunks. Returns whether there are any.
  bool meetNewcomers(const MeshChunks& chunks);

  /// Every listener lacks these.
  void addChanges(const std::set<PackedKey>& chunks);

  /// A listener lacks something and has room for it.
  bool isDue(const QueueShare& share) const;

  /// Sends as much as there is room for, but no more than a share to each.
  void serve(const Source& source, const QueueShare& share);

  TopicStatus report() const;

 private:
  struct Needs {
    bool begins_anew = true;      ///< It has to forget what it may have of a node that ran before.
    std::set<PackedKey> lacking;  ///< Not yet sent as they are now.
    std::set<PackedKey> shown;    ///< That it has triangles of.
    bool any() const { return begins_anew || !lacking.empty(); }
  };

  void sendNext(const Source& source, const QueueShare& share, Needs& first);
  bool isShown(PackedKey chunk) const;

  std::unique_ptr<ChunkWriter> writer_;
  ListenerTopic topic_;
  std::map<std::shared_ptr<ListenerLink>, Needs> listeners_;
};

/// Output's thread only, but for listeners().
class MeshPublisher {
 public:
  struct Style {
    std::string map_frame;
    MeshColour colour = MeshColour::kAuto;  ///< Of the markers.
    int chunk_blocks = 4;
  };

  MeshPublisher(const ros::NodeHandle& nh, const Style& style);

  size_t listeners() const { return markers_.listeners() + blocks_.listeners(); }

  /// Someone listens who does not know yet that chunks have changed.
  bool hasChanges() const { return listeners() > 0 && !chunks_.changed().empty(); }

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

  std::vector<TopicStatus> report() const { return {markers_.report(), blocks_.report()}; }

 private:
  void spreadChanges();

  const int chunk_blocks_;
  MeshChunks chunks_;
  ChunkTopic markers_, blocks_;
};

}  // namespace dtsdf
