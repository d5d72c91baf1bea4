/// The seam below the engine: where voxels are, and the stages that work on them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "backend/backend_error.h"
#include "backend/block_changes.h"
#include "backend/block_mover.h"
#include "backend/map_copy.h"
#include "backend/profile.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/colour/exposure.h"
#include "kernels/core/camera.h"
#include "kernels/core/region.h"
#include "kernels/poses/alignment_sums.h"
#include "kernels/space/squared_distances.h"
#include "map/block_table.h"

namespace dtsdf {

/// What a depth image touches, and what the map lacks of it.
struct TouchedCounts {
  size_t surfels;               ///< With a weight.
  size_t blocks;                ///< That surfels reach.
  size_t requests, new_arrays;  ///< Blocks that are missing or miss arrays; these arrays.
};

/// A depth image's turn to change voxels.
struct FrameTurn {
  uint64_t number;                      ///< Of the frame, from 1.
  const std::vector<int32_t>& in_view;  ///< Slots of blocks that may be in view, and others.
  /// Where it comes in parts: those blocks that it changes in this one, by key; of others none is
  /// in `in_view`. Null: all.
  const std::vector<PackedKey>* part = nullptr;
};

/// How a colour image looks at the map.
struct ColourLook {
  FrameView view;
  int32_t least_evidence;               ///< That a surface needs.
  const std::vector<int32_t>& in_view;  ///< Slots of blocks that may be in view, and others.
};

/// What a colour image shows of surfaces.
struct SeenColours {
  bool any;  ///< Something is to be painted.
  ExposureSums sums;
};

/// A view of the map to be rendered.
struct ViewRequest {
  FrameView frame;
  int32_t least_evidence;  ///< That a surface needs.
  bool has_colours;
};

/// Blocks that the engine has changed in the table, of which a backend may have a mirror.
struct ChangedSlots {
  const std::vector<int32_t>& slots;  ///< Each once. Those not in use any more have gone.
  bool dirty;                         ///< The others are to be meshed again.
};

/// The loops and the memory of one kind of processor. Stages of an image are called in the order in
/// which they stand here; what one of them finds is kept for the next. A stage may return before
/// its work is done. Stages mark the blocks that they change for the next extraction. What is
/// admitted, counted and forgotten is not decided here: see Engine.
class MapBackend {
 public:
  virtual ~MapBackend() = default;

  virtual std::string name() const = 0;

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

  /// Compares the blocks that were found with the map.
  virtual void lookUpBlocks() = 0;

  /// Which of these cubes' cells the image sees through. @pre Something needs free depths.
  virtual void seeFree(std::vector<Vec3i> cubes) = 0;

  /// Waits until blocks are looked up.
  virtual TouchedCounts touched() = 0;
  virtual std::vector<BlockRequest> requests() = 0;

  /// Takes what the stages below need for `touched()`, in the map that an admission leaves.
  /// @throws BackendError without memory.
  virtual void reserveFrame(const FrameTurn& turn) = 0;

  /// Three stages, which a backend may fuse: surfels into sums, sums into voxels, evidence from
  /// voxels that the image contradicts; those too that are in view, whose turn it is, and that it
  /// does not touch.
  virtual void castFoldAndClear(const FrameTurn& turn) = 0;

  /// Waits for the last image. @return what it left empty; reported once.
  virtual std::vector<EmptyBlock> takeEmpty() = 0;

  /// Whether images and extractions look blocks up in a mirror of the table alone, which drops what
  /// an image leaves empty by itself: the table may follow, and list what is new, behind them.
  virtual bool hasMirror() const { return false; }

  /// Waits for the last image. @return what it saw as free, in the order of the cubes given.
  virtual std::vector<FreeCube> takeFree() = 0;

  /// Whether makeDistances() may return true.
  virtual bool makesDistances() const { return false; }

  /// Works distances out, beside images and meshes. @param squares Of each sector that is wanted:
  /// what it had, if it may be overwritten; null after it where all are far.
  /// @return false: the host is to do it. @throws BackendError Without memory nothing has changed.
  virtual bool makeDistances(const DistanceTask& /*task*/,
                             std::vector<std::shared_ptr<uint16_t[]>>& /*squares*/) {
    return false;
  }

  // ---- The stages of a colour image.

  /// Takes the image, which is not needed any more on return. Needs no map, and so may go on beside
  /// what is left of the frame before.
  virtual void takeColours(const ColourFrame& frame) = 0;

  /// Finds what the image that was taken shows of surfaces.
  virtual SeenColours look(const ColourLook& look) = 0;

  /// At least the bricks of colours that are missing for it.
  virtual std::vector<ColourRequest> colourRequests() = 0;

  /// Paints what was found, where there are bricks.
  virtual void paint(const Exposure& exposure) = 0;

  // ---- Views.

  /// Renders surfaces. Waits for the images.
  virtual void render(const ViewRequest& request, RenderedView& view) = 0;

  // ---- Meshes.

  virtual void markAllDirty() = 0;

  /// From now on all meshes have colours: those that exist get theirs with the next extraction.
  virtual void keepColours() = 0;

  /// Starts to mesh what is marked. @param least_evidence That a voxel needs to be known.
  virtual void beginMesh(int32_t least_evidence) = 0;

  /// Whether beginMesh() makes it all.
  virtual bool makesMeshAtOnce() const { return false; }

  /// Waits until an extraction under way has read the map, which may change then.
  virtual void waitForMeshes() = 0;

  /// Waits for the extraction, if one is under way. @return what has changed, by packed key.
  virtual MeshUpdate finishMesh() = 0;

  // ---- Memory and copies. Memory for a change is taken before the table changes.

  /// @throws BackendError without memory; the map is intact then.
  virtual void reserve(const MapDemand& demand) = 0;
  virtual void reserveColours(size_t new_bricks) = 0;
  virtual void reserveChanges(size_t slots) = 0;

  /// Follows an admission to the table: these blocks changed, and these arrays are to be zeroed.
  virtual void enterBlocks(const std::vector<int32_t>& slots,
                           const std::vector<int32_t>& arrays) = 0;
  virtual void enterColours(const std::vector<NewBrick>& bricks) = 0;

  /// Follows other changes of the table; while an extraction reads the map, once it is waited for.
  virtual void follow(const ChangedSlots& changed) = 0;

  /// Empties the voxels of these blocks in a region, with their colours.
  /// @return what became of each.
  virtual std::vector<EmptiedBlock> emptyRegion(const std::vector<int32_t>& slots,
                                                const RegionView& region) = 0;

  virtual void copyOut(const ContentsOrder& order, MapContents& contents) = 0;
  virtual void copyIn(const ContentsOrder& order, const MapContents& contents) = 0;

  /// What moves blocks to disk and back; null where the backend cannot.
  virtual BlockMover* mover() { return nullptr; }
};

/// Makes a backend for the map of a table, which outlives it.
using BackendMaker = std::function<std::unique_ptr<MapBackend>(const BlockTable& table)>;

}  // namespace dtsdf
