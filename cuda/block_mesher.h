/// Incremental meshing on the device: holds the memory, enqueues the stages and downloads meshes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "backend/gaps.h"
#include "backend/map_backend.h"
#include "dtsdf_mapping/block_mesh.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/meshing/corner_grid.h"
#include "kernels/meshing/regularisation.h"
#include "mesh_kernels.h"
#include "runtime/buffer.h"
#include "runtime/device.h"
#include "threads/parallel.h"

namespace dtsdf {
namespace gpu {

constexpr size_t kFirstBlocks = 1 << 14, kFirstVertices = 1 << 16, kFirstTriangles = 1 << 17;
constexpr int kThreadBlocksPerProcessor = 8;

/// Runs one extraction at a time, on its own stream, in parallel with the fusion of frames. begin()
/// enqueues all meshing stages on the device, complete() waits for these and enqueues the download,
/// finish() waits for the download.
class BlockMesher {
 public:
  BlockMesher(const MeshSettings& rules, bool directional, bool refined)
      : rules_(rules),
        directional_(directional),
        refined_(refined),
        thread_blocks_(kThreadBlocksPerProcessor * multiprocessorCount()),
        totals_(1),
        pinned_totals_(1),
        slots_(kFirstBlocks),
        records_(kFirstBlocks),
        vertices_(kFirstVertices),
        triangles_(kFirstTriangles),
        pinned_records_(kFirstBlocks),
        pinned_vertices_(kFirstVertices),
        pinned_triangles_(kFirstTriangles) {
    pinned_totals_[0] = {};
    if (refined_) normals_.reserveExactly(vertices_.capacity(), stream_);
  }

  ~BlockMesher() { stream_.drain(); }

  /// Enqueues the part of an extraction that does not need the map. Call this while the device is
  /// busy with a frame. @pre No extraction is running, or complete() has been called.
  void prepare() {
    if (!is_prepared_) totals_.zero(stream_);
    is_prepared_ = true;
  }

  /// Enqueues an extraction that includes all changes before `map_ready`.
  /// @param max_dirty Upper bound on the number of blocks with changed voxels.
  /// @param max_painted Upper bound on the number of blocks with changed colours.
  /// @param min_evidence Voxels with less evidence count as unknown.
  void begin(const MapView& map, const Event& map_ready, size_t max_dirty, size_t max_painted,
             int32_t min_evidence) {
    map_ = map;
    min_evidence_ = min_evidence;
    prepare();
    is_prepared_ = false;
    stream_.waitFor(map_ready);
    stream_.record(begun_);
    const size_t max_blocks =
        std::min<size_t>(map.slot_count, max_dirty * kBlocksAround + max_painted * kUnitReach);
    slots_.reserve(max_blocks, stream_);
    records_.reserve(max_blocks, stream_);
    if (hasColours()) colours_.reserveExactly(vertices_.capacity(), stream_);
    ++stamp_;
    enqueueIndices();
    enqueueMeshes();
    state_ = State::kBegun;
  }

  void addMemory(MapperMemory& memory) const {
    memory.meshes += vertices_.bytes() + triangles_.bytes() + colours_.bytes() + slots_.bytes() +
                     records_.bytes();
    addScratch(memory, normals_, pinned_records_, pinned_vertices_, pinned_triangles_,
               pinned_colours_);
  }

  /// Call this before the map changes: it waits until a running extraction has finished reading the
  /// map. The download of the meshes may still be running on return.
  void complete() {
    if (state_ != State::kBegun) return;
    counted_.wait();
    const MeshSize size = pinned_totals_[0].size;
    if (size.vertices > vertices_.capacity() || size.triangles > triangles_.capacity()) {
      // vertices_ grows last: if memory runs out before that, vertices_ is still too small, so the
      // next call tries again.
      const size_t with_spare = size.vertices + size.vertices / 2;
      const size_t vertices =
          size.vertices > vertices_.capacity() ? with_spare : vertices_.capacity();
      triangles_.reserve(size.triangles, stream_);
      if (refined_) normals_.reserveExactly(vertices, stream_);
      if (hasColours()) colours_.reserveExactly(vertices, stream_);
      vertices_.reserveExactly(vertices, stream_);
      DTSDF_CHECK_CUDA(cudaMemsetAsync(&totals_.data()->size, 0,
                                       sizeof(MeshTotals) - offsetof(MeshTotals, size),
                                       stream_.get()));
      enqueueMeshes();
      counted_.wait();
    }
    fetch();
    state_ = State::kComplete;
  }

  /// Waits for the extraction. @return the changed meshes; empty if no extraction was started.
  MeshUpdate finish() {
    MeshUpdate made;
    if (state_ == State::kIdle) return made;
    complete();
    fetched_.wait();
    state_ = State::kIdle;
    made.blocks = copyBlocks(changedRecords());
    made.duration_ms = fetched_.millisecondsSince(begun_);
    return made;
  }

  /// Whether an extraction may still be reading the map.
  bool isUnderWay() const { return state_ == State::kBegun; }

  /// Whether the stored marching cubes cases of unchanged blocks were computed with this minimum
  /// evidence.
  bool hasLabelsFor(int32_t min_evidence) const {
    return stamp_ > 0 && min_evidence_ == min_evidence;
  }

  /// Whether the mesh that finish() last returned for the block in a slot has triangles.
  /// takeHasMesh() clears this when the block leaves the device; setHasMesh() restores it when the
  /// block returns.
  bool takeHasMesh(int32_t slot) { return std::exchange(hasMesh(slot), uint8_t{0}) != 0; }
  void setHasMesh(int32_t slot, bool has_mesh) { hasMesh(slot) = has_mesh; }

 private:
  enum class State { kIdle, kBegun, kComplete };

  MeshView view() {
    MeshView view;
    view.totals = totals_.data();
    view.host_totals = pinned_totals_.data();
    view.slots = slots_.data();
    view.records = records_.data();
    view.vertices = vertices_.data();
    view.normals = normals_.data();
    view.triangles = triangles_.data();
    view.colours = colours_.data();
    view.capacity = {static_cast<uint32_t>(vertices_.capacity()),
                     static_cast<uint32_t>(triangles_.capacity())};
    view.stamp = stamp_;
    view.min_evidence = min_evidence_;
    view.directional = directional_;
    view.refined = refined_;
    view.rules = rules_;
    return view;
  }

  void enqueueIndices() {
    reachBlocks(map_, view(), thread_blocks_, stream_);
    indexBlocks(map_, view(), thread_blocks_, stream_);
    if (hasColours()) selectPainted(map_, view(), thread_blocks_, stream_);
  }

  void enqueueMeshes() {
    makeMeshes(map_, view(), thread_blocks_, stream_);
    if (hasColours()) colourVertices(map_, view(), thread_blocks_, stream_);
    stream_.record(counted_);
  }

  bool hasColours() const { return map_.colour_of != nullptr; }
  void fetch() {
    const MeshSize size = pinned_totals_[0].size;
    pinned_records_.reserve(recordCount());
    pinned_vertices_.reserve(size.vertices);
    pinned_triangles_.reserve(size.triangles);
    records_.download(pinned_records_.data(), recordCount(), stream_);
    vertices_.download(pinned_vertices_.data(), size.vertices, stream_);
    triangles_.download(pinned_triangles_.data(), size.triangles, stream_);
    if (hasColours()) {
      pinned_colours_.reserve(size.vertices);
      colours_.download(pinned_colours_.data(), size.vertices, stream_);
    }
    stream_.record(fetched_);
  }

  uint8_t& hasMesh(int32_t slot) {
    const auto place = static_cast<size_t>(slot);
    if (has_mesh_.size() <= place) has_mesh_.resize(place + 1, 0);
    return has_mesh_[place];
  }

  size_t recordCount() const { return pinned_totals_[0].reached + pinned_totals_[0].adjoining; }

  std::vector<MeshRecord> changedRecords() {
    std::vector<MeshRecord> changed;
    changed.reserve(recordCount());
    for (size_t i = 0; i < recordCount(); ++i) {
      const MeshRecord& record = pinned_records_[i];
      uint8_t& has_mesh = hasMesh(record.slot);
      const bool has_triangles = record.triangles > record.gaps;
      if (has_triangles || has_mesh) changed.push_back(record);
      has_mesh = has_triangles;
    }
    std::sort(changed.begin(), changed.end(),
              [](const MeshRecord& a, const MeshRecord& b) { return a.key < b.key; });
    return changed;
  }

  BlockMesh copyBlock(const MeshRecord& record) const {
    BlockMesh mesh;
    mesh.key = unpackKey(record.key);
    const BlockVertex* vertex = pinned_vertices_.data() + record.first_vertex;
    mesh.vertices.assign(vertex, vertex + record.vertices);
    const uint16_t* corner = pinned_triangles_[record.first_triangle].vertex;
    mesh.triangles.assign(corner, corner + 3 * static_cast<size_t>(record.triangles));
    if (hasColours()) {
      const VertexColour* colour = pinned_colours_.data() + record.first_vertex;
      mesh.colours.assign(colour, colour + record.vertices);
    }
    if (record.gaps > 0) dropGaps(mesh);
    return mesh;
  }

  std::vector<BlockMesh> copyBlocks(const std::vector<MeshRecord>& records) const {
    constexpr size_t kMinOfThread = 512, kMaxThreads = 4;
    std::vector<BlockMesh> blocks(records.size());
    const size_t parts = std::clamp<size_t>(records.size() / kMinOfThread, 1, kMaxThreads);
    parallelFor(parts, 0, [&](size_t part) {
      const size_t end = records.size() * (part + 1) / parts;
      for (size_t i = records.size() * part / parts; i < end; ++i)
        blocks[i] = copyBlock(records[i]);
    });
    return blocks;
  }

  MeshSettings rules_;
  bool directional_, refined_;
  int thread_blocks_;  ///< Enough to fill the device; kernels use grid-stride loops.
  Stream stream_;
  Event begun_{cudaEventDefault}, fetched_{cudaEventDefault}, counted_;
  State state_ = State::kIdle;
  bool is_prepared_ = false;
  MapView map_ = {};
  uint32_t stamp_ = 0;
  int32_t min_evidence_ = 0;
  DeviceBuffer<MeshTotals> totals_;
  PinnedBuffer<MeshTotals> pinned_totals_;  ///< Written in place by a kernel.
  DeviceBuffer<int32_t> slots_;
  DeviceBuffer<MeshRecord> records_;
  DeviceBuffer<BlockVertex> vertices_;
  DeviceBuffer<Vec3f> normals_;  ///< One per vertex; only if meshes are refined.
  DeviceBuffer<BlockTriangle> triangles_;
  PinnedBuffer<MeshRecord> pinned_records_;
  PinnedBuffer<BlockVertex> pinned_vertices_;
  PinnedBuffer<BlockTriangle> pinned_triangles_;
  DeviceBuffer<VertexColour> colours_;  ///< One per vertex, once anything is painted.
  PinnedBuffer<VertexColour> pinned_colours_;
  std::vector<uint8_t> has_mesh_;  ///< Whether the last returned mesh of each slot has triangles.
};

}  // namespace gpu
}  // namespace dtsdf
