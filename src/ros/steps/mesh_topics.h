/// The step that publishes the mesh in chunks: as markers for every viewer, and as blocks for
/// little bandwidth.
#pragma once

#include <dtsdf_mapping/MeshBlocks.h>
#include <visualization_msgs/MarkerArray.h>

#include <atomic>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "ros/common/pace.h"
#include "ros/common/topic.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// A topic of the mesh: an ordinary publisher, and the chunks that are still to be published. They
/// go in pieces, a few at a time, never more than its queue holds: a listener that never reads
/// costs that queue, and delays nobody.
class ChunkTopic {
 public:
  /// Of the mutex of the mesh, but for isFollowed() and status().
  virtual ~ChunkTopic() = default;

  /// Pieces that wait for a listener at most, and how large one is, about.
  static constexpr uint32_t kQueue = 20;
  static constexpr size_t kPieceBytes = 1 << 20;
  /// Of one round; ten of them a second are 40 MB/s.
  static constexpr int kPiecesPerRound = 4;

  bool isFollowed() const { return topic_.isFollowed(); }
  bool takeNewcomer() { return topic_.takeNewcomer(); }

  void add(const std::vector<PackedKey>& chunks) {
    pending_.insert(chunks.begin(), chunks.end());
    lacking_ = pending_.size();
  }
  void clear() {
    pending_.clear();
    lacking_ = 0;
  }
  bool isBehind() const { return !pending_.empty(); }

  /// Publishes some pieces of what is pending.
  void publishRound(const MeshChunks& chunks, int chunk_blocks, ShownMesh& mesh);

  dtsdf_mapping::TopicStatus status() const;

 protected:
  /// A message that is put together chunk by chunk.
  virtual void begin(double step_m, const ros::Time& stamp) = 0;
  /// One without triangles is removed by its receiver. `id` is the chunk's for ever.
  virtual void add(PackedChunk chunk, int id) = 0;
  virtual size_t bytes() const = 0;  ///< Of the message so far, about.
  virtual void publish() = 0;

  /// @param begins What a newcomer gets first, so that it forgets what a node before has published.
  template <class Message, class Begins>
  void advertise(const ros::NodeHandle& nh, const std::string& name, Begins begins) {
    topic_.advertise<Message>(nh, name, kQueue,
                              [begins](const auto& newcomer) { newcomer.publish(begins()); });
  }

  Topic topic_;

 private:
  std::set<PackedKey> pending_, shown_;  ///< Of the latter, triangles were published.
  std::atomic<size_t> lacking_{0};       ///< As many are pending, for the status.
};

/// `mesh` and `mesh_blocks`. Changes go to all; after somebody has connected, the whole mesh is
/// published once more; and all of it again within mesh_topics/refresh_s, for who has lost a piece.
class MeshTopicsStep : public Step {
 public:
  /// Both outlive it.
  MeshTopicsStep(const MappingParams& params, const Rates& rates);

  void advertise(const Handles& handles) override;
  std::optional<double> meshRate_hz() const override;
  void changed(const MeshChanges& changes) override;
  SteadyDuration publish(ShownMesh* mesh) override;
  void fill(dtsdf_mapping::MapStatus& status) override;

 private:
  void spread(SteadyTime now);
  std::vector<PackedKey> nextToRefresh(SteadyTime now);

  const MappingParams& params_;
  const Rates& rates_;
  MeshChunks chunks_;
  std::vector<std::unique_ptr<ChunkTopic>> topics_;
  Pace mesh_pace_, round_pace_;
  SteadyTime refreshed_at_{};
  PackedKey refreshed_ = 0;  ///< The chunk that was refreshed last.
};

}  // namespace dtsdf
