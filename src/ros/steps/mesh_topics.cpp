#include "ros/steps/mesh_topics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "ros/common/chunk_message.h"

namespace dtsdf {

using dtsdf_mapping::MeshBlocks;
using dtsdf_mapping::TopicStatus;
using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

namespace {

constexpr double kRoundRate_hz = 10.0;
/// How often a part of the mesh is refreshed.
constexpr double kRefreshPeriod_s = 1.0;
constexpr size_t kBytesOfPoint = 3 * sizeof(double) + 4 * sizeof(float);
constexpr size_t kBytesOfMarker = 200;

std_msgs::ColorRGBA toColour(const std::array<uint8_t, 3>& rgb) {
  std_msgs::ColorRGBA colour;
  colour.r = static_cast<float>(rgb[0]) / 255.0f;
  colour.g = static_cast<float>(rgb[1]) / 255.0f;
  colour.b = static_cast<float>(rgb[2]) / 255.0f;
  colour.a = 1.0f;
  return colour;
}

geometry_msgs::Point toPoint(const std::array<double, 3>& p_W) {
  geometry_msgs::Point point;
  point.x = p_W[0];
  point.y = p_W[1];
  point.z = p_W[2];
  return point;
}

/// `mesh`: a TRIANGLE_LIST for each chunk, with a colour per vertex.
class MarkerTopic : public ChunkTopic {
 public:
  MarkerTopic(const ros::NodeHandle& nh, const MappingParams& params)
      : map_frame_(frameOfMap(params.node)), colour_(params.mapper.mesh.colour) {
    advertise<MarkerArray>(nh, "mesh", [this] {
      MarkerArray begins;
      begins.markers.push_back(marker(0, Marker::DELETEALL));
      return begins;
    });
  }

 protected:
  void begin(double step_m, const ros::Time&) override {
    message_ = MarkerArray();
    step_m_ = step_m;
    bytes_ = 0;
  }

  void add(PackedChunk chunk, int id) override {
    const bool is_empty = chunk.triangleCount() == 0;
    message_.markers.push_back(marker(id, is_empty ? Marker::DELETE : Marker::ADD));
    bytes_ += kBytesOfMarker;
    if (!is_empty) fill(chunk, message_.markers.back());
  }

  size_t bytes() const override { return bytes_; }
  void publish() override { topic_.publish(message_); }

 private:
  Marker marker(int id, int action) const {
    Marker marker;
    marker.header.frame_id = map_frame_;  // stamp 0: shown with the newest transforms of the viewer
    marker.ns = "mesh";
    marker.id = id;
    marker.action = action;
    marker.pose.orientation.w = 1.0;
    return marker;
  }

  void fill(const PackedChunk& chunk, Marker& marker) {
    const Mesh mesh = unpackChunk(chunk, step_m_);
    std::vector<geometry_msgs::Point> points;
    std::vector<std_msgs::ColorRGBA> colours;
    for (size_t i = 0; i < chunk.vertexCount(); ++i) {
      points.push_back(toPoint(positionOf(chunk, step_m_, i)));
      colours.push_back(toColour(vertexColour(colour_, mesh, i)));
    }
    marker.type = Marker::TRIANGLE_LIST;
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
    marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1.0f;
    const size_t corners = 3 * chunk.triangleCount();
    marker.points.reserve(corners);
    marker.colors.reserve(corners);
    for (size_t i = 0; i < corners; ++i) {
      marker.points.push_back(points[chunk.corner(i)]);
      marker.colors.push_back(colours[chunk.corner(i)]);
    }
    bytes_ += kBytesOfPoint * corners;
  }

  const std::string map_frame_;
  const MeshColour colour_;
  double step_m_ = 0.0;  ///< Of the message that was begun.
  MarkerArray message_;
  size_t bytes_ = 0;
};

/// `mesh_blocks`: chunks as they are packed.
class BlockTopic : public ChunkTopic {
 public:
  BlockTopic(const ros::NodeHandle& nh, const MappingParams& params)
      : map_frame_(frameOfMap(params.node)),
        step_m_(
            ChunkLattice(params.mapper.map.voxel_size_m, params.node.publish.chunk_blocks).step_m) {
    advertise<MeshBlocks>(nh, "mesh_blocks", [this] {
      MeshBlocks begins;
      begins.header.frame_id = map_frame_;
      begins.begins_anew = true;
      begins.step_m = step_m_;
      return begins;
    });
  }

 protected:
  void begin(double step_m, const ros::Time& stamp) override {
    step_m_ = step_m;
    message_ = MeshBlocks();
    message_.header.frame_id = map_frame_;
    message_.header.stamp = stamp;
    message_.step_m = step_m;
    bytes_ = 0;
  }

  void add(PackedChunk chunk, int) override {
    bytes_ += bytesInMessage(chunk);
    message_.blocks.push_back(toMessage(std::move(chunk)));
  }

  size_t bytes() const override { return bytes_; }
  void publish() override { topic_.publish(message_); }

 private:
  const std::string map_frame_;
  std::atomic<double> step_m_;
  MeshBlocks message_;
  size_t bytes_ = 0;
};

}  // namespace

void ChunkTopic::publishRound(const MeshChunks& chunks, int chunk_blocks, ShownMesh& mesh) {
  const ChunkLattice lattice(mesh.meshes.voxelSize(), chunk_blocks);
  auto next = pending_.begin();
  for (int piece = 0; piece < kPiecesPerRound && next != pending_.end(); ++piece) {
    begin(lattice.step_m, mesh.stamp);
    bool is_empty = true;
    while (next != pending_.end() && bytes() < kPieceBytes) {
      const PackedKey key = *next;
      const std::vector<PackedKey> blocks = chunks.blocksOf(key);
      const uint64_t failures = mesh.meshes.stats().failures;
      const MeshStore& store = mesh.meshes.holding(blocks);
      if (mesh.meshes.stats().failures > failures) {  // is read again in the next round
        ++next;
        continue;
      }
      PackedChunk chunk = packChunk(store, lattice, chunks.cornerOf(key), blocks);
      next = pending_.erase(next);
      if (chunk.triangleCount() > 0) shown_.insert(key);
      if (shown_.count(key) == 0) continue;
      add(std::move(chunk), chunks.idOf(key));
      is_empty = false;
    }
    if (!is_empty) publish();
  }
  lacking_ = pending_.size();
}

TopicStatus ChunkTopic::status() const {
  TopicStatus status = topic_.status();
  status.lacking_chunks = static_cast<uint32_t>(lacking_);
  return status;
}

MeshTopicsStep::MeshTopicsStep(const MappingParams& params, const Rates& rates)
    : params_(params),
      rates_(rates),
      chunks_(params.node.publish.chunk_blocks),
      mesh_pace_(rates.mesh_hz),
      round_pace_(kRoundRate_hz) {}

void MeshTopicsStep::advertise(const Handles& handles) {
  topics_.push_back(std::make_unique<MarkerTopic>(handles.prompt, params_));
  topics_.push_back(std::make_unique<BlockTopic>(handles.prompt, params_));
}

std::optional<double> MeshTopicsStep::meshRate_hz() const {
  const bool is_wanted = std::any_of(topics_.begin(), topics_.end(),
                                     [](const auto& topic) { return topic->isFollowed(); });
  return is_wanted ? std::optional<double>(rates_.mesh_hz) : std::nullopt;
}

void MeshTopicsStep::changed(const MeshChanges& changes) {
  if (changes.cleared) chunks_.markAllChanged();
  for (const SharedBlockMesh& block : changes.blocks) chunks_.markChanged(block->key);
}

SteadyDuration MeshTopicsStep::publish(ShownMesh* mesh) {
  if (mesh == nullptr) return SteadyDuration::max();
  const SteadyTime now = std::chrono::steady_clock::now();
  mesh_pace_.setRate(rates_.mesh_hz, now);
  spread(now);
  bool is_behind = false;
  for (const auto& topic : topics_) {
    if (round_pace_.isDue(now)) {
      topic->publishRound(chunks_, params_.node.publish.chunk_blocks, *mesh);
    }
    is_behind = is_behind || topic->isBehind();
  }
  mesh->meshes.dropFetched();
  if (round_pace_.isDue(now)) {
    // Of the thread's time at least half is for others that share the cores.
    const SteadyTime end = std::chrono::steady_clock::now();
    round_pace_.begin(now);
    round_pace_.restUntil(end + (end - now));
  }
  if (is_behind) return round_pace_.next() - now;
  return chunks_.changed().empty() ? SteadyDuration::max() : mesh_pace_.next() - now;
}

/// What is to be published becomes pending.
void MeshTopicsStep::spread(SteadyTime now) {
  const bool is_due = !chunks_.changed().empty() && mesh_pace_.isDue(now);
  if (is_due) mesh_pace_.beginInStep(now);
  const std::vector<PackedKey> refreshed = nextToRefresh(now);
  for (const auto& topic : topics_) {
    if (!topic->isFollowed()) {
      topic->clear();
      continue;
    }
    if (topic->takeNewcomer()) topic->add(chunks_.all());
    if (is_due) topic->add({chunks_.changed().begin(), chunks_.changed().end()});
    topic->add(refreshed);
  }
  if (is_due) chunks_.forgetChanges();
}

std::vector<PackedKey> MeshTopicsStep::nextToRefresh(SteadyTime now) {
  const double refresh_s = params_.node.publish.mesh_refresh_s;
  const double passed_s = toSeconds(now - refreshed_at_);
  if (refresh_s <= 0.0 || passed_s < kRefreshPeriod_s) return {};
  refreshed_at_ = now;
  const std::vector<PackedKey> all = chunks_.all();
  const auto share = static_cast<size_t>(
      std::ceil(static_cast<double>(all.size()) * kRefreshPeriod_s / refresh_s));
  auto next = std::upper_bound(all.begin(), all.end(), refreshed_);
  std::vector<PackedKey> keys;
  for (size_t i = 0; i < std::min(share, all.size()); ++i, ++next) {
    if (next == all.end()) next = all.begin();
    keys.push_back(*next);
  }
  if (!keys.empty()) refreshed_ = keys.back();
  return keys;
}

void MeshTopicsStep::fill(dtsdf_mapping::MapStatus& status) {
  for (const auto& topic : topics_) status.topics.push_back(topic->status());
}

}  // namespace dtsdf
