/// The seam of the package: everything outside drives a map through this interface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "dtsdf_mapping/alignment.h"
#include "dtsdf_mapping/block_mesh.h"
#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/map_contents.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "dtsdf_mapping/region.h"
#include "dtsdf_mapping/rendered_view.h"
#include "dtsdf_mapping/space.h"

/// Everything of the library.
namespace dtsdf {

/// What became of a frame.
enum class FrameStatus {
  kFused,          ///< It is part of the map, or cleared what it saw through, or painted it.
  kBadImage,       ///< No data, no pixels, too many pixels, or rows that overlap.
  kBadIntrinsics,  ///< Focal length not positive, or a value that is not finite.
  kBadPose,        ///< Not finite, not a rotation, or outside the coordinates a map can hold.
  kNoMeasurement,  ///< No pixel with a depth in range and a normal, nor beyond to clear with; of
                   ///< a colour image: it sees no surface of the map.
  kNoMemory,       ///< The GPU has too little memory for this frame; a later one may have enough.
};

/// A word for messages ("bad pose").
const char* toString(FrameStatus status);

/// What a call of integrate() or paint() did.
struct IntegrationResult {
  FrameStatus status = FrameStatus::kFused;  ///< All but kFused left the map as it was.
  std::string message;                       ///< What was wrong with a frame that was not fused.
  size_t refused_blocks = 0;  ///< Blocks and arrays this frame wanted beyond the budget.
  double duration_ms = 0.0;   ///< Wall time of the call.
};

/// What of a map lies on disk, with map/page_folder. Counts are since the start or the last
/// clear().
struct PageStats {
  size_t blocks = 0;       ///< That lie there now.
  size_t bytes = 0;        ///< Of the disk, that they take.
  size_t space_bytes = 0;  ///< Of the disk, that cells and distances of space() take.
  size_t index_bytes = 0;  ///< Of memory, beside map_bytes, that it takes to know of them.
  uint64_t written = 0;    ///< Blocks that were written.
  uint64_t read = 0;       ///< Blocks that were read back.
  uint64_t waits = 0;      ///< Calls that had to wait for the disk.
  double wait_ms = 0.0;    ///< For how long, all together.
  uint64_t failures = 0;   ///< Reads and writes that failed, or found the folder full.
  /// Blocks, and sectors of 32 x 32 x 32 cells, that were there and came back damaged.
  uint64_t lost = 0;
  std::string problem;  ///< What the last failure was; empty: there was none.
};

/// How large a map is.
struct MapStats {
  size_t blocks = 0;        ///< Blocks of 8 x 8 x 8 voxels, in memory.
  size_t voxel_arrays = 0;  ///< Directional arrays in use, over all these blocks.
  /// Bytes in use by blocks and arrays in memory; with `free_bytes` never above the budget.
  size_t map_bytes = 0;
  uint64_t refused_blocks = 0;  ///< Refusals since the start or the last clear().
  size_t colour_bytes = 0;  ///< Those of map_bytes that hold colour; 0 until something is painted.
  uint64_t dropped_blocks = 0;  ///< Beyond map/keep_radius_m, since the start or the last clear().
  size_t free_bytes = 0;        ///< Bytes of the budget that space() has for what is free.
  /// Refusals of cubes of 8 x 8 x 8 cells of space, of which an image saw something as free that is
  /// unknown now for want of budget; since the start or the last clear().
  uint64_t refused_cubes = 0;
  /// What map_bytes stays within: map/max_memory_mb, less an eighth with space/enabled.
  size_t max_map_bytes = 0;
  size_t map_bytes_peak = 0;  ///< The most that map_bytes was, since the start or the last clear().
  PageStats pages;            ///< All 0 without map/page_folder.
};

/// What a mapper has taken from the system, in bytes, beside MapStats::map_bytes. None of it bounds
/// the map: which blocks are refused follows from the budget and from what is mapped alone.
struct MapperMemory {
  bool on_gpu = false;  ///< Where the map and all of this is, but for `staging`, `space`.
  size_t spare = 0;     ///< Room for voxels and colours to come.
  size_t indices = 0;   ///< Of blocks and mesh units, beyond what map_bytes counts of them.
  size_t meshes = 0;    ///< On a GPU: those that were made last.
  size_t scratch = 0;   ///< What a frame needs while it is fused, kept for the next one.
  size_t staging = 0;   ///< On the host beside a GPU.
  size_t space = 0;     ///< Cells and distances of space(); on the host, also beside a GPU.
};

/// What clearRegion() took away.
struct ClearedRegion {
  size_t voxels = 0;  ///< That held something; those of a place's several directions count each.
  size_t blocks = 0;  ///< Now empty, and freed.
};

/// A map that depth frames are fused into, colour images are painted on, and meshes are extracted
/// from. Not thread safe: one
/// thread at a time, not always the same one; two mappers know nothing of each other. Equal frames
/// in equal order give equal maps and meshes, bit for bit, on every backend and with any number of
/// threads.
class Mapper {
 public:
  virtual ~Mapper() = default;

  /// Fuses a frame. A bad frame leaves the map untouched; the result's status reports it.
  /// @throws std::exception when the backend fails (a CUDA error, out of host memory).
  virtual IntegrationResult integrate(const DepthFrame& frame) = 0;

  /// Finds the pose at which a frame fits the map best, near its own T_W_C, which is off by about
  /// as much as the prior says. The map stays as it was; integrate() the frame at the pose found.
  /// @return the frame's own pose, not aligned, for a frame that integrate() would refuse.
  /// @throws std::exception when the backend fails.
  virtual Alignment align(const DepthFrame& frame, const PosePrior& prior) = 0;

  /// Paints the surfaces of the map that a colour image sees. They have to be there: what depth
  /// frames show later is painted by later images. A surface that faces another direction, as the
  /// back of a thin plate does, keeps its own colour; what the map itself hides from the camera is
  /// left alone. Costs nothing, in time or memory, where it is never called.
  /// @throws std::exception when the backend fails.
  virtual IntegrationResult paint(const ColourFrame& frame) = 0;

  /// Renders the surfaces of the map that face a camera, those that a mesh would have now, whether
  /// or not it was extracted. The map stays as it was. Equal maps give equal bytes on every
  /// backend.
  /// @param camera Size and intrinsics of the images.
  /// @param T_W_C Optical frame to map frame, in metres.
  /// @param view Takes the images; its memory is used again, which spares time in a loop.
  /// @throws std::invalid_argument for a camera or a pose that integrate() would refuse;
  /// std::exception when the backend fails.
  virtual void render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                      RenderedView& view) = 0;

  /// The same into images of its own.
  RenderedView render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C) {
    RenderedView view;
    render(camera, T_W_C, view);
    return view;
  }

  /// Starts to mesh the blocks that changed since the last extraction. On a GPU this returns before
  /// the work is done, and frames may be integrated meanwhile. At most one extraction is under way.
  /// @throws std::exception when the backend fails.
  virtual void beginMeshUpdate() = 0;

  /// Whether finishMeshUpdate() would return at once: on a CPU. False where that is not known.
  virtual bool isMeshMade() const { return false; }

  /// Waits for the extraction that was begun and returns its changes; empty if none was begun.
  /// @throws std::exception when the backend fails.
  virtual MeshUpdate finishMeshUpdate() = 0;

  /// Both at once: meshes the blocks that changed, and returns when that is done. All of them,
  /// though finishMeshUpdate() hands them out part by part.
  MeshUpdate updateMesh();

  /// Empties the voxels whose centres lie in a region, of all directions, with their colours, and
  /// frees arrays and blocks that hold nothing then. The next mesh update has what that changes;
  /// what an extraction under way returns may still show it. Frames may fill the region again.
  /// @throws std::invalid_argument for a region with a problem (see findProblem()); the map is
  /// untouched then. PartlyCleared where blocks on disk cannot come back. std::exception when the
  /// backend fails.
  virtual ClearedRegion clearRegion(const Region& region) = 0;

  /// Forgets everything, an extraction under way included. Clear the MeshStore with it.
  virtual void clear() = 0;

  /// A copy of the map as it is now; waits for the frames and images before it. Name of the frame
  /// and stamp of the newest image are left to the caller, who knows them.
  /// @throws std::exception when the backend fails (a CUDA error, out of host memory).
  virtual MapContents contents() = 0;

  /// What contents() has besides voxels and colours: with outline() and part() a map is copied
  /// piece by piece that is larger than memory (map/page_folder).
  /// @throws std::exception when the backend fails.
  virtual MapContents outline() = 0;

  /// Voxels and colours of blocks that outline() has, in its order; no frame came in between.
  /// @throws std::exception when the backend fails, or a block is on disk and cannot be read.
  virtual MapContents part(const std::vector<MapBlock>& blocks) = 0;

  /// What is known of the space around the surfaces; null unless space/enabled. Lives as long as
  /// the mapper.
  virtual Space* space() { return nullptr; }

  /// Sizes of the map as it is now.
  virtual MapStats stats() const = 0;

  /// Memory of the mapper as it is now, beside map_bytes.
  virtual MapperMemory memory() const = 0;

  /// "cpu (2 threads)" or "cuda (name of the device)".
  virtual std::string backendName() const = 0;
};

/// Makes a mapper on the backend that `params.backend` asks for.
/// @throws std::runtime_error if CUDA is asked for and cannot be used; the text says why.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params);

/// Makes a mapper that continues where the contents were taken; its first mesh update has the whole
/// mesh. The contents may be from another backend.
/// @throws std::runtime_error as checkContents(), checkFits() and makeMapper() do, or if there is
/// too little memory on the GPU.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params, const MapContents& contents);

/// Empty if a CUDA mapper can be made on this machine, else the reason why not.
std::string cudaUnavailableReason();

}  // namespace dtsdf
