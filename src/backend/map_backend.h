/// Interface between the engine and a backend, which owns the voxels and runs the stages.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/backend_error.h"
#include "backend/map_copy.h"
#include "backend/profile.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/colour/exposure.h"
#include "kernels/core/camera.h"
#include "kernels/core/region.h"
#include "kernels/meshing/unit_samples.h"
#include "kernels/poses/alignment_sums.h"
#include "kernels/space/squared_distances.h"
#include "map/block_table.h"
#include "map/mesh_state.h"

namespace dtsdf {

/// Blocks that a depth image touches.
struct TouchedBlocks {
  size_t blocks = 0;                   ///< Number of blocks that surfels touch.
  std::vector<BlockRequest> requests;  ///< Missing blocks, and blocks with missing arrays.
  size_t new_arrays = 0;               ///< Number of missing arrays.
};

/// Outcome of fusing a depth image.
struct FrameOutcome {
  std::vector<EmptyBlock> empty;  ///< Blocks with arrays that are empty now.
  std::vector<CubeMask> free;     ///< Cells found by seeFree(), in the order of its cubes; cubes
                                  ///< without free cells are omitted.
};

/// Result of findColours().
struct SeenColours {
  bool any = false;  ///< Whether the image can paint anything.
  ExposureSums sums{};
  /// Colour bricks (of 4 x 4 x 4 voxels) to create; some may already exist.
  std::vector<ColourRequest> requests;
};

/// A view of the map to render.
struct ViewRequest {
  FrameView frame;
  int32_t min_evidence;  ///< Minimum evidence of a surface.
  bool has_colours;
};

/// Changes to the table, for backends that mirror it.
struct TableChanges {
  const std::vector<int32_t>& slots;  ///< Slots of changed and released blocks, each once.
  bool dirty = false;                 ///< Whether to mesh the changed blocks again.
  const std::vector<int32_t>* new_arrays = nullptr;   ///< New arrays to zero.
  const std::vector<NewBrick>* new_bricks = nullptr;  ///< New bricks to zero.
};

/// Meshing states of some blocks. `labels` contains the labels of all mesh units, block by block,
/// for those blocks that have labels.
struct MeshStates {
  std::vector<MeshState> states;
  PlainArray<UnitLabels> labels;
};

/// Upper bounds on the memory that a change to the table needs.
struct MemoryDemand {
  size_t new_blocks = 0, new_arrays = 0;  ///< Numbers to create.
  size_t new_bricks = 0;
  bool has_colours = false;  ///< Whether the change adds or turns on colours.
  size_t changed = 0;        ///< Blocks that change in other ways, or move.
};

/// Computes squared distances in the sectors of a task, concurrently with fusion and meshing.
/// `squares` has one entry per wanted sector: on entry the sector's old array if it may be
/// overwritten, otherwise null; on return the new array, or null if no surface is near enough.
/// @return false if the host must compute the distances.
using DistanceWork = std::function<bool(const DistanceTask& task,
                                        std::vector<std::shared_ptr<uint16_t[]>>& squares)>;

struct BackendTraits {
  std::string name;
  /// Whether the backend looks up blocks in its own mirror of the table, from which it removes
  /// arrays that an image leaves empty. The engine may then delay updating the table and calling
  /// publish().
  bool indexes_blocks_itself = false;
  bool meshes_at_once = false;  ///< Whether beginMesh() does all the work.
  DistanceWork distance_work;   ///< Null if the host computes distances. May outlive the backend.
};

/// Runs the stages and owns the memory on one kind of processor. The stages of an image are called
/// in the order below, and each keeps its results for the next. A stage may return before its work
/// is done. Stages mark the blocks that they change for the next extraction. The Engine decides
/// which blocks are admitted, counted and dropped.
class MapBackend {
 public:
  virtual ~MapBackend() = default;

  virtual BackendTraits traits() const = 0;

  /// Must be called first on each thread from which the backend is used.
  virtual void enter() = 0;

  /// Makes all stages add their host time to the profile, until called with nullptr.
  virtual void profileTo(Profile* /*profile*/) {}
  /// Adds the memory in use. `indices` includes memory that map_bytes also counts.
  virtual void addMemory(MapperMemory& memory) const = 0;

  // ---- Stages of a depth image.

  /// For alignment: takePoints() selects points of an image, and sumsAt() sums their normal
  /// equations at a pose.
  virtual void takePoints(const DepthFrame& frame, const FrameView& view) = 0;
  virtual AlignmentSums sumsAt(const FrameView& view, float cutoff) = 0;

  /// The next three stages must not use the map, as they run concurrently with the engine's helper
  /// thread, which moves blocks.
  virtual void sense(const DepthFrame& frame, const FrameView& view) = 0;
  virtual void makeSurfels() = 0;
  virtual void findBlocks() = 0;

  /// Looks up the blocks found by findBlocks() in the map, and waits for the result.
  virtual TouchedBlocks lookUpBlocks() = 0;

  /// Finds the cells of `cubes` that are free according to the image. @pre needsFreeDepth()
  virtual void seeFree(std::vector<Vec3i> cubes) = 0;

  /// Allocates what the following stages need for the blocks returned by lookUpBlocks(). Called
  /// before the blocks are admitted. @throws BackendError if memory runs out.
  /// @param in_view Slots of all blocks that may be in view, and possibly others.
  virtual void reserveFrame(const std::vector<int32_t>& in_view) = 0;

  /// Three stages, which a backend may combine: adds surfels to sums, folds sums into voxels, and
  /// lowers the evidence of voxels that the image contradicts. The last stage only runs if
  /// clearsFreeSpace(). It also checks untouched blocks in view, each in one of several frames
  /// (isInTurn()).
  /// @param frame_number Counted from 1.
  /// @param in_view Slots of all blocks that may be in view, and possibly others.
  virtual void castFoldAndClear(uint64_t frame_number, const std::vector<int32_t>& in_view) = 0;

  /// Waits until the last depth image is fused. @return its outcome; further calls return an empty
  /// outcome.
  virtual FrameOutcome takeOutcome() = 0;

  // ---- Stages of a colour image.

  /// Copies the image, which the caller may discard afterwards. Does not use the map, so it may be
  /// called before the previous frame is finished.
  virtual void takeColours(const ColourFrame& frame) = 0;

  /// Finds the surfaces that are visible in the image passed to takeColours().
  /// @param min_evidence Minimum evidence of a surface.
  /// @param in_view Slots of all blocks that may be in view, and possibly others.
  virtual SeenColours findColours(const FrameView& view, int32_t min_evidence,
                                  const std::vector<int32_t>& in_view) = 0;

  /// Paints the surfaces found by findColours() whose bricks exist.
  virtual void paint(const Exposure& exposure) = 0;

  // ---- Views.

  /// Renders surfaces, and waits for the images.
  virtual void render(const ViewRequest& request, RenderedView& view) = 0;

  // ---- Meshes.

  /// Marks all blocks for the next extraction. With `marks.painted`, all meshes contain colours
  /// from then on.
  virtual void markAll(const MeshMarks& marks) = 0;

  /// Starts to mesh the marked blocks. @param min_evidence Voxels with less evidence count as
  /// unknown.
  virtual void beginMesh(int32_t min_evidence) = 0;

  /// Waits until an extraction in progress, if any, has read the map, so that the map may change.
  virtual void waitForMeshes() = 0;

  /// Waits for the extraction in progress, if any. @return changed meshes, sorted by packed key.
  virtual MeshUpdate finishMesh() = 0;

  // ---- Memory and copies. Memory for a change is reserved before the table changes.

  /// Reserves memory. @throws BackendError if memory runs out; the map is unchanged.
  virtual void reserve(const MemoryDemand& demand) = 0;

  /// Mirrors changes to the table. Call waitForMeshes() before adding arrays or bricks; other
  /// changes may be delayed until an extraction in progress has read the map.
  virtual void follow(const TableChanges& changes) = 0;

  /// Empties those voxels of the given blocks that lie in a region, and removes their colours.
  /// @return the effect on each block.
  virtual std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                                const RegionView& region) = 0;

  /// Copies voxels and colours into `contents`.
  /// @param taken If not null, receives the meshing states of the slots. The slots lose their
  /// states and marks, and can then be released.
  /// @throws BackendError if memory runs out; nothing is changed.
  virtual void copyOut(const ContentsOrder& order, MapContents& contents,
                       MeshStates* taken = nullptr) = 0;
  /// Copies voxels and colours from `contents`.
  /// @param given If not null, the new meshing states of the slots.
  virtual void copyIn(const ContentsOrder& order, const MapContents& contents,
                      const MeshStates* given = nullptr) = 0;

  // ---- For map/page_folder only.

  /// Blocks that the last depth image touches, whether or not they are in the map, and all blocks
  /// in `others` that it may clear without touching them. @pre lookUpBlocks()
  virtual std::vector<PackedKey> neededKeys(const std::vector<PackedKey>& others,
                                            uint64_t frame_number) = 0;

  /// Blocks that sumsAt() may read, without duplicates.
  virtual std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) = 0;

  /// Blocks marked for the next extraction. setMarks() marks additional blocks. @pre No extraction
  /// is in progress. @param taken Whether to remove the marks.
  virtual std::vector<MarkedSlot> marked(bool taken) = 0;
  virtual void setMarks(const std::vector<MarkedSlot>& marked) = 0;
};

/// Creates a backend for the blocks of a table, which must outlive the backend.
using BackendMaker = std::function<std::unique_ptr<MapBackend>(const BlockTable& table)>;

}  // namespace dtsdf
