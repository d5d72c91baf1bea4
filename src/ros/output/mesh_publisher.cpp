#include "ros/output/mesh_publisher.h"

#include "ros/output/chunk_writer.h"

namespace dtsdf {

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
