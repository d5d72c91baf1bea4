/// The step that publishes the mesh in chunks (cubes of blocks), as markers and in a compact form.
#include <dtsdf_mapping/MeshBlocks.h>
#include <visualization_msgs/MarkerArray.h>

#include <array>
#include <atomic>
#include <cmath>
#include <set>
#include <utility>

#include "meshing/mesh_chunks.h"
#include "meshing/packed_chunk.h"
#include "ros/common/chunk_message.h"
#include "ros/common/topic.h"
#include "ros/input/conversions.h"
#include "ros/steps/make_steps.h"

namespace dtsdf {

using dtsdf_mapping::MeshBlocks;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

namespace {

/// A piece is a part of the mesh that is sent as one message. Maximum number of pieces queued per
/// listener, and approximate size of a piece.
constexpr uint32_t kQueuePieces = 20;
constexpr size_t kPieceBytes = 1 << 20;
/// Approximate size of a triangle on `mesh` and on `mesh_blocks`.
constexpr size_t kMarkerBytes = 120, kBlockBytes = 14;
/// Maximum number of pieces per round and topic. At ten rounds per second, this limits each topic
/// to about 40 MB/s.
constexpr int kPiecesPerRound = 4;
constexpr double kRoundRate_hz = 10.0;
/// Interval at which some of the chunks are published again; see mesh_topics/refresh_s.
constexpr double kRefreshPeriod_s = 1.0;

std_msgs::ColorRGBA toColour(const std::array<uint8_t, 3>& rgb) {
  std_msgs::ColorRGBA colour;
  colour.r = static_cast<float>(rgb[0]) / 255.0f;
  colour.g = static_cast<float>(rgb[1]) / 255.0f;
  colour.b = static_cast<float>(rgb[2]) / 255.0f;
  colour.a = 1.0f;
  return colour;
}

// Topic `mesh`: a TRIANGLE_LIST per chunk, with a colour per vertex. With stamp 0, viewers use the
// latest transform.

Marker makeMarker(const NodeParams& params, int id, int action) {
  Marker marker;
  marker.header.frame_id = frameOfMap(params);
  marker.ns = "mesh";
  marker.id = id;
  marker.action = action;
  marker.pose.orientation.w = 1.0;
  return marker;
}

Marker toMarker(const NodeParams& params, double step_m, const PackedChunk& chunk, int id) {
  const size_t corners = 3 * chunk.triangleCount();
  Marker marker = makeMarker(params, id, corners == 0 ? Marker::DELETE : Marker::ADD);
  if (corners == 0) return marker;
  const Mesh mesh = unpackChunk(chunk, step_m);
  std::vector<geometry_msgs::Point> points;
  std::vector<std_msgs::ColorRGBA> colours;
  for (size_t i = 0; i < chunk.vertexCount(); ++i) {
    const std::array<double, 3> p_W = positionOf(chunk, step_m, i);
    points.push_back(tf2::toMsg(Eigen::Vector3d(p_W[0], p_W[1], p_W[2])));
    colours.push_back(toColour(vertexColour(params.mapper.mesh.colour, mesh, i)));
  }
  marker.type = Marker::TRIANGLE_LIST;
  marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
  marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1.0f;
  marker.points.reserve(corners);
  marker.colors.reserve(corners);
  for (size_t i = 0; i < corners; ++i) {
    marker.points.push_back(points[chunk.corner(i)]);
    marker.colors.push_back(colours[chunk.corner(i)]);
  }
  return marker;
}

/// Publishes the same chunks on `mesh` and `mesh_blocks`: every change, and the whole mesh when a
/// listener connects. For listeners that lost a piece, the whole mesh is also published again, part
/// by part, every mesh_topics/refresh_s. Only a few pieces are published per round, so a listener
/// that never reads its messages fills its own queue but does not delay other listeners.
class MeshTopicsStep : public Step {
 public:
  MeshTopicsStep(const NodeParams& params, const std::atomic<double>& rate_hz)
      : params_(params),
        rate_hz_(rate_hz),
        step_m_(ChunkLattice(params.mapper.map.voxel_size_m, params.chunk_blocks).step_m),
        chunks_(params.chunk_blocks),
        mesh_pace_(rate_hz),
        round_pace_(kRoundRate_hz) {}

  /// A new listener first gets a message that clears any mesh from an earlier node.
  void advertise(const Handles& handles) override {
    markers_.advertise<MarkerArray>(
        handles.prompt, "mesh", kQueuePieces, [this](const auto& newcomer) {
          MarkerArray message;
          message.markers.push_back(makeMarker(params_, 0, Marker::DELETEALL));
          newcomer.publish(message);
        });
    blocks_.advertise<MeshBlocks>(handles.prompt, "mesh_blocks", kQueuePieces,
                                  [this](const auto& newcomer) {
                                    MeshBlocks message = makeBlocks(ros::Time());
                                    message.begins_anew = true;
                                    newcomer.publish(message);
                                  });
  }

  std::optional<double> meshRate_hz() const override {
    return isWanted() ? std::optional<double>(rate_hz_) : std::nullopt;
  }

  void changed(const MeshChanges& changes) override {
    if (changes.cleared) chunks_.markAllChanged();
    for (const auto& [key, block] : changes.blocks) chunks_.markChanged(block->key);
  }

  SteadyDuration publish(ShownMesh* mesh) override {
    if (mesh == nullptr) return SteadyDuration::max();
    const SteadyTime now = std::chrono::steady_clock::now();
    mesh_pace_.setRate(rate_hz_, now);
    addPending(now);
    if (round_pace_.isDue(now)) {
      publishRound(*mesh);
      // Pauses for as long as the round took, to leave the core to other threads.
      round_pace_.end(now);
    }
    if (!pending_.empty()) return round_pace_.next() - now;
    return chunks_.changed().empty() ? SteadyDuration::max() : mesh_pace_.next() - now;
  }

 private:
  bool isWanted() const { return markers_.hasSubscribers() || blocks_.hasSubscribers(); }

  MeshBlocks makeBlocks(const ros::Time& stamp) const {
    MeshBlocks message;
    message.header.frame_id = frameOfMap(params_);
    message.header.stamp = stamp;
    message.step_m = step_m_;
    return message;
  }

  /// Marks changed chunks as pending, or all chunks if there is a new listener, and some chunks to
  /// be published again.
  void addPending(SteadyTime now) {
    const auto add = [this](const auto& keys) { pending_.insert(keys.begin(), keys.end()); };
    const bool has_newcomer = markers_.takeNewSubscriber() | blocks_.takeNewSubscriber();
    if (has_newcomer) add(chunks_.all());
    if (!chunks_.changed().empty() && mesh_pace_.isDue(now)) {
      mesh_pace_.beginInStep(now);
      add(chunks_.changed());
      chunks_.forgetChanges();
    }
    const double refresh_s = params_.mesh_refresh_s;
    if (refresh_s > 0.0 && toSeconds(now - refreshed_at_) >= kRefreshPeriod_s) {
      refreshed_at_ = now;
      const auto all = static_cast<double>(chunks_.all().size());
      add(chunks_.nextRoundRobin(
          static_cast<size_t>(std::ceil(all * kRefreshPeriod_s / refresh_s))));
    }
    if (!isWanted()) pending_.clear();
  }

  /// Publishes a few pieces of the pending chunks.
  void publishRound(ShownMesh& mesh) {
    const ChunkLattice lattice(mesh.meshes.voxelSize(), params_.chunk_blocks);
    step_m_ = lattice.step_m;
    const bool has_markers = markers_.hasSubscribers();
    const size_t triangle_bytes = has_markers ? kMarkerBytes : kBlockBytes;
    auto next = pending_.begin();
    for (int piece = 0; piece < kPiecesPerRound && next != pending_.end(); ++piece) {
      MeshStore store(mesh.meshes.voxelSize());
      std::vector<PackedKey> keys;
      for (; next != pending_.end() && triangle_bytes * store.triangleCount() < kPieceBytes;
           ++next) {
        const uint64_t failures = mesh.meshes.stats().failures;
        mesh.meshes.addTo(store, chunks_.blocksOf(*next));
        if (mesh.meshes.stats().failures > failures) continue;  // retried in the next round
        keys.push_back(*next);
      }
      auto packed = packChunks(store, lattice, chunks_, keys, params_.mapper.threads);
      MarkerArray markers;
      MeshBlocks blocks = makeBlocks(mesh.stamp);
      for (size_t i = 0; i < keys.size(); ++i) {
        pending_.erase(keys[i]);
        if (packed[i].triangleCount() > 0) shown_.insert(keys[i]);
        if (shown_.count(keys[i]) == 0) continue;
        if (has_markers) {
          markers.markers.push_back(toMarker(params_, step_m_, packed[i], chunks_.idOf(keys[i])));
        }
        blocks.blocks.push_back(toMessage(std::move(packed[i])));
      }
      if (blocks.blocks.empty()) continue;
      if (has_markers) markers_.publish(markers);
      blocks_.publish(blocks);
    }
  }

  const NodeParams& params_;
  const std::atomic<double>& rate_hz_;
  std::atomic<double> step_m_;  ///< See ChunkLattice.
  MeshChunks chunks_;
  Topic markers_, blocks_;
  std::set<PackedKey> pending_, shown_;  ///< Chunks still to publish; chunks published before.
  Pace mesh_pace_, round_pace_;
  SteadyTime refreshed_at_{};
};

}  // namespace

std::unique_ptr<Step> makeMeshTopicsStep(const NodeParams& params,
                                         const std::atomic<double>& rate_hz) {
  return std::make_unique<MeshTopicsStep>(params, rate_hz);
}

}  // namespace dtsdf
