/// Interface between the engine and a backend, which owns the voxels and computes the stages.
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
  std::vector<CubeMask> free;     ///< Cells that the image shows to be free; cubes in the order
                                  ///< given to seeFree(), without empty ones.
};

/// What a colour image can paint.
struct SeenColours {
  bool any = false;  ///< Whether there is anything to paint.
  ExposureSums sums{};
  std::vector<ColourRequest> requests;  ///< Bricks to paint: all that are missing, maybe others.
};

/// A view of the map to render.
struct ViewRequest {
  FrameView frame;
  int32_t min_evidence;  ///< Minimum evidence of a surface.
  bool has_colours;
};

/// Changes that the engine made to the table, which a backend may mirror.
struct TableChanges {
  const std::vector<int32_t>& slots;  ///< Changed and released slots, without duplicates.
  bool dirty = false;                 ///< Whether to mesh the changed blocks again.
  const std::vector<int32_t>* new_arrays = nullptr;   ///< New arrays to zero.
  const std::vector<NewBrick>* new_bricks = nullptr;  ///< New bricks to zero.
};

/// Meshing states of some blocks. `labels` contains, block by block, the labels of all units of
/// the blocks that have labels.
struct MeshStates {
  std::vector<MeshState> states;
  PlainArray<UnitLabels> labels;
};

/// Upper bounds on the memory that a change to the table needs.
struct MemoryDemand {
  size_t new_blocks = 0, new_arrays = 0;  ///< Created by an admission.
  size_t new_bricks = 0;
  bool has_colours = false;  ///< Whether the change adds or turns on colours.
  size_t changed = 0;        ///< Blocks that change in other ways, or move.
};

/// Computes the distances of a task's sectors. Runs concurrently with images and meshes. `squares`
/// has one entry per wanted sector: on entry its old array if that may be overwritten, otherwise
/// null; on return its new array, or null if no surface is near enough.
/// @return false if the host must compute them.
using DistanceWork = std::function<bool(const DistanceTask& task,
                                        std::vector<std::shared_ptr<uint16_t[]>>& squares)>;

struct BackendTraits {
  std::string name;
  /// The backend looks up blocks in its own mirror of the table, from which it removes arrays that
  /// an image leaves empty. So the engine may update and publish() the table later.
  bool indexes_blocks_itself = false;
  bool meshes_at_once = false;  ///< Whether beginMesh() does all the work.
  DistanceWork distance_work;   ///< Null if the host computes distances. May outlive the backend.
};

/// Runs the stages and owns the memory on one kind of processor. The stages of an image are called
/// in the order below, and each keeps its results for the next. A stage may return before its work
/// is done. Stages mark the blocks that they change for the next extraction. The Engine decides
/// what is admitted, counted and dropped.
class MapBackend {
 public:
  virtual ~MapBackend() = default;

  virtual BackendTraits traits() const = 0;

  /// Must be called on the thread that uses the backend from now on.
  virtual void enter() = 0;

  /// From now on, stages add their host time to the profile; nullptr ends this.
  virtual void profileTo(Profile* /*profile*/) {}
  /// Adds the memory in use. `indices` includes the part that map_bytes counts as well.
  virtual void addMemory(MapperMemory& memory) const = 0;

  // ---- Stages of a depth image.

  /// For alignment: takePoints() selects points of an image, sumsAt() sums their normal equations
  /// at a pose.
  virtual void takePoints(const DepthFrame& frame, const FrameView& view) = 0;
  virtual AlignmentSums sumsAt(const FrameView& view, float cutoff) = 0;

  /// The next three stages must not use the map: they run concurrently with the engine's helper,
  /// which moves blocks.
  virtual void sense(const DepthFrame& frame, const FrameView& view) = 0;
  virtual void makeSurfels() = 0;
  virtual void findBlocks() = 0;

  /// Looks up the blocks of findBlocks() in the map, and waits for the result.
  virtual TouchedBlocks lookUpBlocks() = 0;

  /// Finds the cells of `cubes` that the image shows to be free. @pre needsFreeDepth()
  virtual void seeFree(std::vector<Vec3i> cubes) = 0;

  /// Allocates what the following stages need for the blocks of lookUpBlocks(). Called before their
  /// admission. @throws BackendError if memory runs out.
  /// @param in_view Slots of all blocks that may be in view, and possibly others.
  virtual void reserveFrame(const std::vector<int32_t>& in_view) = 0;

  /// Three stages, which a backend may combine: adds surfels to sums, folds sums into voxels, and
  /// lowers the evidence of voxels that the image contradicts. The last stage, if any
  /// (clearsFreeSpace()), also checks blocks in view that the image does not touch, when it is
  /// their turn.
  /// @param frame_number Counted from 1.
  /// @param in_view Slots of all blocks that may be in view, and possibly others.
  virtual void castFoldAndClear(uint64_t frame_number, const std::vector<int32_t>& in_view) = 0;

  /// Waits for the last image, if it was fused. @return its outcome; later calls return an empty
  /// one.
  virtual FrameOutcome takeOutcome() = 0;

  // ---- Stages of a colour image.

  /// Copies the image, which the caller may discard afterwards. Does not use the map, so it may be
  /// called before the previous frame is finished.
  virtual void takeColours(const ColourFrame& frame) = 0;

  /// Finds which surfaces the image of takeColours() shows.
  /// @param min_evidence Minimum evidence of a surface.
  /// @param in_view Slots of all blocks that may be in view, and possibly others.
  virtual SeenColours findColours(const FrameView& view, int32_t min_evidence,
                                  const std::vector<int32_t>& in_view) = 0;

  /// Paints the surfaces of findColours() that have bricks.
  virtual void paint(const Exposure& exposure) = 0;

  // ---- Views.

  /// Renders surfaces, and waits for the images.
  virtual void render(const ViewRequest& request, RenderedView& view) = 0;

  // ---- Meshes.

  /// Marks all blocks for the next extraction. Once marked as painted, all meshes have colours.
  virtual void markAll(const MeshMarks& marks) = 0;

  /// Starts to mesh the marked blocks. @param min_evidence Voxels with less evidence count as
  /// unknown.
  virtual void beginMesh(int32_t min_evidence) = 0;

  /// Waits until any extraction under way has read the map, so that the map may change.
  virtual void waitForMeshes() = 0;

  /// Waits for the extraction, if one is under way. @return changed meshes, sorted by packed key.
  virtual MeshUpdate finishMesh() = 0;

  // ---- Memory and copies. Memory for a change is reserved before the table changes.

  /// Reserves memory. @throws BackendError if memory runs out; the map is unchanged.
  virtual void reserve(const MemoryDemand& demand) = 0;

  /// Applies changes to the table. Call waitForMeshes() before adding arrays or bricks; other
  /// changes may wait until an extraction under way has read the map.
  virtual void follow(const TableChanges& changes) = 0;

  /// Empties those voxels of the given blocks that lie in a region, and removes their colours.
  /// @return the effect on each block.
  virtual std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                                const RegionView& region) = 0;

  /// Copies voxels and colours into contents.
  /// @param taken If not null, receives the meshing states of the slots. Their marks are then
  /// removed, so that the slots can be released.
  /// @throws BackendError if memory runs out; nothing is changed.
  virtual void copyOut(const ContentsOrder& order, MapContents& contents,
                       MeshStates* taken = nullptr) = 0;
  /// Copies voxels and colours from contents.
  /// @param given If not null, the new meshing states of the slots.
  virtual void copyIn(const ContentsOrder& order, const MapContents& contents,
                      const MeshStates* given = nullptr) = 0;

  // ---- For map/page_folder only.

  /// Blocks that the last depth image touches, whether or not they are in the map, and those of
  /// `others` that the image may clear without touching them. @pre lookUpBlocks()
  virtual std::vector<PackedKey> neededKeys(const std::vector<PackedKey>& others,
                                            uint64_t frame_number) = 0;

  /// Blocks that sumsAt() may read, without duplicates.
  virtual std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) = 0;

  /// Blocks marked for the next extraction. setMarks() marks additional ones. @pre No extraction is
  /// under way. @param taken Whether to remove the marks.
  virtual std::vector<MarkedSlot> marked(bool taken) = 0;
  virtual void setMarks(const std::vector<MarkedSlot>& marked) = 0;
};

/// Makes a backend for the map of a table. The table must outlive the backend.
using BackendMaker = std::function<std::unique_ptr<MapBackend>(const BlockTable& table)>;

}  // namespace dtsdf
