/// A topic of the mesh in chunks: to each listener what it lacks, in messages of bounded size, as
/// fast as it reads.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "meshing/mesh_chunks.h"
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

  TopicReport report() const;

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

}  // namespace dtsdf
