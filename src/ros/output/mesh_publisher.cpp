#include "ros/output/mesh_publisher.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "ros/output/chunk_writer.h"

namespace dtsdf {
namespace {

/// A message is cut where it is larger: small enough that some fit into a listener's share, but not
/// so small that the queue of a subscriber, which counts messages, overflows.
size_t messageBytes(const QueueShare& share) {
  constexpr size_t kLeast = 64 << 10, kMost = 4 << 20;
  return std::clamp(share.bytes / 8, kLeast, kMost);
}

}  // namespace

ChunkTopic::ChunkTopic(const ros::NodeHandle& nh, std::unique_ptr<ChunkWriter> writer)
    : writer_(std::move(writer)), topic_(nh, writer_->advertiseOptions()) {}

bool ChunkTopic::meetNewcomers(const MeshChunks& chunks) {
  bool is_any_new = false;
  follow(topic_.links(), listeners_, [&](Needs& needs) {
    is_any_new = true;
    for (const PackedKey chunk : chunks.all()) needs.lacking.insert(chunk);
  });
  return is_any_new;
}

void ChunkTopic::addChanges(const std::set<PackedKey>& chunks) {
  for (auto& [link, needs] : listeners_) needs.lacking.insert(chunks.begin(), chunks.end());
}

bool ChunkTopic::isDue(const QueueShare& share) const {
  return std::any_of(listeners_.begin(), listeners_.end(), [&](const auto& listener) {
    return listener.second.any() && share.hasRoom(*listener.first, messageBytes(share));
  });
}

void ChunkTopic::serve(const Source& source, const QueueShare& share) {
  for (auto& [link, needs] : listeners_) {
    // One that reads while it is served must not have the thread for ever.
    for (size_t sent = 0; sent < share.bytes; sent += messageBytes(share)) {
      if (!needs.any() || !share.hasRoom(*link, messageBytes(share))) break;
      sendNext(source, share, needs);
    }
  }
}

bool ChunkTopic::isShown(PackedKey chunk) const {
  return std::any_of(listeners_.begin(), listeners_.end(),
                     [&](const auto& listener) { return listener.second.shown.count(chunk) > 0; });
}

/// Writes one message of what the first listener lacks, and sends it to all who lack the same.
void ChunkTopic::sendNext(const Source& source, const QueueShare& share, Needs& first) {
  const bool anew = first.begins_anew;
  std::vector<PackedKey> taken;                     // from what is lacking
  std::vector<std::pair<PackedKey, bool>> written;  // and whether there are triangles
  writer_->begin(anew, source.step_m, source.stamp);
  for (const PackedKey key : first.lacking) {
    if (writer_->bytes() >= messageBytes(share)) break;
    std::optional<PackedChunk> chunk = source.pack(key);
    if (!chunk) continue;  // it is lacking still
    taken.push_back(key);
    const bool is_visible = chunk->triangleCount() > 0;
    if (!is_visible && !isShown(key)) continue;
    written.emplace_back(key, is_visible);
    writer_->add(std::move(*chunk), source.chunks.idOf(key));
  }
  const bool is_empty = written.empty() && !anew;
  const ros::SerializedMessage message = is_empty ? ros::SerializedMessage() : writer_->finish();

  for (auto& [link, needs] : listeners_) {
    if (&needs != &first &&
        (needs.begins_anew != anew || !share.hasRoom(*link, messageBytes(share)) ||
         !std::includes(needs.lacking.begin(), needs.lacking.end(), taken.begin(), taken.end()))) {
      continue;
    }
    if (!is_empty) topic_.send(*link, message);
    needs.begins_anew = false;
    for (const PackedKey key : taken) needs.lacking.erase(key);
    for (const auto& [key, is_visible] : written) {
      if (is_visible) {
        needs.shown.insert(key);
      } else {
        needs.shown.erase(key);
      }
    }
  }
}

TopicStatus ChunkTopic::report() const {
  TopicStatus report = topic_.report();
  for (const auto& [link, needs] : listeners_) {
    report.lacking_chunks =
        std::max(report.lacking_chunks, static_cast<uint32_t>(needs.lacking.size()));
  }
  return report;
}

MeshPublisher::MeshPublisher(const ros::NodeHandle& nh, const Style& style)
    : chunk_blocks_(style.chunk_blocks),
      chunks_(style.chunk_blocks),
      markers_(nh, makeMarkerWriter(style.map_frame, style.colour)),
      blocks_(nh, makeBlockWriter(style.map_frame)) {}

bool MeshPublisher::isBehind(const QueueShare& share) const {
  return markers_.isDue(share) || blocks_.isDue(share);
}

void MeshPublisher::meetNewcomers() {
  // Both are asked. What a newcomer lacks has all changes in it: they must not come a second time.
  const bool is_new_to_markers = markers_.meetNewcomers(chunks_);
  const bool is_new_to_blocks = blocks_.meetNewcomers(chunks_);
  if (is_new_to_markers || is_new_to_blocks) spreadChanges();
}

void MeshPublisher::spreadChanges() {
  markers_.addChanges(chunks_.changed());
  blocks_.addChanges(chunks_.changed());
  chunks_.forgetChanges();
}

void MeshPublisher::publishChanges(PagedMeshes& meshes, const ros::Time& stamp,
                                   const QueueShare& share) {
  spreadChanges();
  catchUp(meshes, stamp, share);
}

void MeshPublisher::catchUp(PagedMeshes& meshes, const ros::Time& stamp, const QueueShare& share) {
  const ChunkLattice lattice(meshes.voxelSize(), chunk_blocks_);
  const auto pack = [&](PackedKey chunk) -> std::optional<PackedChunk> {
    const std::vector<PackedKey> blocks = chunks_.blocksOf(chunk);
    const uint64_t failures = meshes.stats().failures;
    const MeshStore& store = meshes.holding(blocks);
    if (meshes.stats().failures > failures) return std::nullopt;
    return packChunk(store, lattice, chunks_.cornerOf(chunk), blocks);
  };
  const ChunkTopic::Source source{chunks_, pack, lattice.step_m, stamp};
  markers_.serve(source, share);
  blocks_.serve(source, share);
}

}  // namespace dtsdf
