/// The seam below the engine: where voxels are, and the stages that work on them.
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

/// What a depth image touches, and what the map lacks of it.
struct TouchedBlocks {
  size_t blocks = 0;                   ///< That surfels reach.
  std::vector<BlockRequest> requests;  ///< Those that are missing or miss arrays.
  size_t new_arrays = 0;               ///< That these miss.
};

/// What a depth image left.
struct FrameOutcome {
  std::vector<EmptyBlock> empty;  ///< Blocks of which arrays are empty now.
  std::vector<CubeMask> free;     ///< Cells that it saw through, in the order of the cubes given.
};

/// What a colour image shows of surfaces.
struct SeenColours {
  bool any = false;  ///< Something is to be painted.
  ExposureSums sums{};
  std::vector<ColourRequest> requests;  ///< At least the bricks of colours that are missing for it.
};

/// A view of the map to be rendered.
struct ViewRequest {
  FrameView frame;
  int32_t least_evidence;  ///< Evidence that a surface needs.
  bool has_colours;
};

/// What the engine has changed in the table, of which a backend may have a mirror.
struct TableChanges {
  const std::vector<int32_t>& slots;  ///< Each once. Those not in use any more are released.
  bool dirty = false;                 ///< The others are to be meshed again.
  const std::vector<int32_t>* new_arrays = nullptr;   ///< Admitted: to be zeroed.
  const std::vector<NewBrick>* new_bricks = nullptr;  ///< Admitted: to be zeroed.
};

/// What meshing knows of some blocks, with the labels of all units, block by block, of those that
/// have some.
struct MeshStates {
  std::vector<MeshState> states;
  PlainArray<UnitLabels> labels;
};

/// Upper bounds of what a change of the table takes.
struct MemoryDemand {
  size_t new_blocks = 0, new_arrays = 0;  ///< Made by an admission.
  size_t new_bricks = 0;
  bool has_colours = false;  ///< The map has colours from now on.
  size_t changed = 0;        ///< Blocks that change otherwise, or move.
};

/// Works out the distances of a task's sectors, beside images and meshes. The vector has, for each
/// sector that is wanted, what it had, if it may be overwritten; null after it where all are far.
/// @return false: the host is to do it.
using DistanceWork = std::function<bool(const DistanceTask& task,
                                        std::vector<std::shared_ptr<uint16_t[]>>& squares)>;

struct BackendTraits {
  std::string name;
  /// Images and extractions look blocks up in a mirror of the table alone, which drops what an
  /// image leaves empty by itself: the table may follow, and list what is new, behind them.
  bool indexes_blocks_itself = false;
  bool meshes_at_once = false;  ///< beginMesh() makes it all.
  DistanceWork distance_work;   ///< In place of the host; it may outlive the backend. Or null.
};

/// The loops and the memory of one kind of processor. Stages of an image are called in the order in
/// which they stand here; what one of them finds is kept for the next. A stage may return before
/// its work is done. Stages mark the blocks that they change for the next extraction. What is
/// admitted, counted and forgotten is not decided here: see Engine.
class MapBackend {
 public:
  virtual ~MapBackend() = default;

  virtual BackendTraits traits() const = 0;

  /// The calling thread uses the backend from here on.
  virtual void enter() = 0;

  /// Stages add their time to the profile from here on, until nullptr is given.
  virtual void profileTo(Profile* profile) = 0;
  virtual void addMemory(std::vector<MemoryPart>& parts) const = 0;

  // ---- The stages of a depth image.

  /// align: takes points of an image; then their sums at poses of it.
  virtual void takePoints(const DepthFrame& frame, const FrameView& view) = 0;
  virtual AlignmentSums sumsAt(const FrameView& view, float cutoff) = 0;

  /// The three that follow run beside the engine's helper, which moves blocks: they know the image
  /// alone, and look nothing up in the map.
  virtual void sense(const DepthFrame& frame, const FrameView& view) = 0;
  virtual void makeSurfels() = 0;
  virtual void findBlocks() = 0;

  /// Compares the blocks that were found with the map, and waits for that.
  virtual TouchedBlocks lookUpBlocks() = 0;

  /// Which of these cubes' cells the image sees through. @pre Something needs free depths.
  virtual void seeFree(std::vector<Vec3i> cubes) = 0;

  /// Takes what the stages below need for the blocks that were looked up, in the map that an
  /// admission leaves. @throws BackendError without memory.
  /// @param in_view Slots of blocks that may be in view, and others.
  virtual void reserveFrame(const std::vector<int32_t>& in_view) = 0;

  /// Three stages, which a backend may fuse: surfels into sums, sums into voxels, evidence from
  /// voxels that the image contradicts; those too that are in view, whose turn it is, and that it
  /// does not touch.
  /// @param frame_number From 1. @param in_view As above.
  virtual void castFoldAndClear(uint64_t frame_number, const std::vector<int32_t>& in_view) = 0;

  /// Waits for the last image, if it was fused. @return what it left; reported once.
  virtual FrameOutcome takeOutcome() = 0;

  // ---- The stages of a colour image.

  /// Takes the image, which is not needed any more on return. Needs no map, and so may go on beside
  /// what is left of the frame before.
  virtual void takeColours(const ColourFrame& frame) = 0;

  /// Finds what the image that was taken shows of surfaces. @param least_evidence That one needs.
  /// @param in_view Slots of blocks that may be in view, and others.
  virtual SeenColours look(const FrameView& view, int32_t least_evidence,
                           const std::vector<int32_t>& in_view) = 0;

  /// Paints what was found, where there are bricks.
  virtual void paint(const Exposure& exposure) = 0;

  // ---- Views.

  /// Renders surfaces. Waits for the images.
  virtual void render(const ViewRequest& request, RenderedView& view) = 0;

  // ---- Meshes.

  /// Marks all blocks. The first time that they are painted: from now on all meshes have colours.
  virtual void markAll(const MeshMarks& marks) = 0;

  /// Starts to mesh what is marked. @param least_evidence That a voxel needs to be known.
  virtual void beginMesh(int32_t least_evidence) = 0;

  /// Waits until an extraction under way has read the map, which may change then.
  virtual void waitForMeshes() = 0;

  /// Waits for the extraction, if one is under way. @return what has changed, by packed key.
  virtual MeshUpdate finishMesh() = 0;

  // ---- Memory and copies. Memory for a change is taken before the table changes.

  /// @throws BackendError without memory; the map is intact then.
  virtual void reserve(const MemoryDemand& demand) = 0;

  /// Follows the table; while an extraction reads the map, once it is waited for.
  virtual void follow(const TableChanges& changes) = 0;

  /// Empties the voxels of these blocks in a region, with their colours.
  /// @return what became of each.
  virtual std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                                const RegionView& region) = 0;

  /// @param taken Gets what meshing knows of the order's slots, which are marked no longer and may
  /// be released then. @throws BackendError without memory; nothing has changed then.
  virtual void copyOut(const ContentsOrder& order, MapContents& contents,
                       MeshStates* taken = nullptr) = 0;
  /// @param given What meshing is to know of the order's slots, where it is not null.
  virtual void copyIn(const ContentsOrder& order, const MapContents& contents,
                      const MeshStates* given = nullptr) = 0;

  // ---- What only map/page_folder needs.

  /// Blocks, in the map or not, that the last depth image touches, and those of a list that it may
  /// clear though it does not touch them. @pre lookUpBlocks()
  virtual std::vector<PackedKey> neededKeys(const std::vector<PackedKey>& others,
                                            uint64_t frame_number) = 0;

  /// Blocks that sumsAt() looks at, each once.
  virtual std::vector<PackedKey> alignedKeys(const FrameView& view, float cutoff) = 0;

  /// What is marked for the next extraction, and marks beside it. @pre None is under way.
  /// @param taken It is marked no longer.
  virtual std::vector<MarkedSlot> marked(bool taken) = 0;
  virtual void setMarks(const std::vector<MarkedSlot>& marked) = 0;
};

/// Makes a backend for the map of a table, which outlives it.
using BackendMaker = std::function<std::unique_ptr<MapBackend>(const BlockTable& table)>;

}  // namespace dtsdf
