/// Interface to a map, for programs, the node and other packages.
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

/// Namespace of the library.
namespace dtsdf {

/// What became of a frame.
enum class FrameStatus {
  kFused,          ///< The image was fused, painted, or used only to clear space.
  kBadImage,       ///< No data, no pixels, too many pixels, rows that overlap, or a bad unit.
  kBadIntrinsics,  ///< Not finite, or impossible for the size of the image.
  kBadPose,  ///< Not finite, not a rotation, or outside the coordinates a map can hold; also if
             ///< keep_center_W is not finite.
  kNoMeasurement,  ///< No pixel has a depth that can be fused or used to clear. For a colour image:
                   ///< it shows no surface of the map well enough to paint it.
  kNoMemory,       ///< The GPU has too little memory for this frame; a later one may succeed.
};

/// Short description for messages ("bad pose").
const char* toString(FrameStatus status);

/// Result of integrate() or paint().
struct IntegrationResult {
  FrameStatus status = FrameStatus::kFused;  ///< The map is unchanged unless this is kFused.
  std::string message;                       ///< Why the frame was not fused; or a warning.
  size_t refused_blocks = 0;  ///< Requests for blocks, arrays or bricks that were refused for lack
                              ///< of memory.
  double duration_ms = 0.0;   ///< Wall time of the call.
};

/// The part of a map on disk, with map/page_folder. clear() resets the counters.
struct PageStats {
  size_t blocks = 0;       ///< Blocks on disk now.
  size_t bytes = 0;        ///< Disk space used by blocks.
  size_t space_bytes = 0;  ///< Disk space used by cells and distances of space().
  size_t index_bytes = 0;  ///< Memory used by the index and by pending writes; not part of
                           ///< map_bytes.
  uint64_t written = 0;    ///< Blocks written.
  uint64_t read = 0;       ///< Blocks read back.
  uint64_t waits = 0;      ///< Waits for the disk that took a millisecond or more.
  double wait_ms = 0.0;    ///< Total time of the waits in `waits`.
  uint64_t failures = 0;   ///< Failed reads and writes, including writes to a full folder.
  /// Blocks, and sectors of 32 x 32 x 32 cells, that were lost because they were damaged on disk
  /// or, for sectors, unreadable when they had to be changed.
  uint64_t lost = 0;
  std::string problem;  ///< Description of the last failure; empty: none.
};

/// Size of a map.
struct MapStats {
  size_t blocks = 0;        ///< Blocks of 8 x 8 x 8 voxels, in memory.
  size_t voxel_arrays = 0;  ///< Directional arrays in use, over all blocks in memory.
  /// Bytes of blocks, arrays and colours in memory. At most max_map_bytes, except as described
  /// there.
  size_t map_bytes = 0;
  uint64_t refused_blocks = 0;  ///< Requests refused since the start or the last clear().
  size_t colour_bytes = 0;      ///< Part of map_bytes that holds colour; 0 before any painting.
  uint64_t dropped_blocks = 0;  ///< Dropped beyond map/keep_radius_m, since the start or clear().
  size_t free_bytes = 0;        ///< Bytes of the budget used by free cells of space().
  /// How often, since the start or the last clear(), the budget had no room for a cube of 8 x 8 x 8
  /// cells that an image showed to be partly free.
  uint64_t refused_cubes = 0;
  /// Limit of map_bytes: map/max_memory_mb, less an eighth with space/enabled. With
  /// map/page_folder, a single image that needs more may exceed it.
  size_t max_map_bytes = 0;
  size_t map_bytes_peak = 0;  ///< Largest map_bytes since the start or the last clear().
  PageStats pages;            ///< All 0 without map/page_folder.
};

/// Memory that a mapper has allocated, in bytes, in addition to MapStats::map_bytes. It does not
/// count towards the budget: which blocks are refused depends on map_bytes and the budget only.
struct MapperMemory {
  bool on_gpu = false;  ///< Whether the map, and everything here but `staging` and `space`, is on a
                        ///< GPU.
  size_t spare = 0;     ///< Room for future voxels and colours.
  size_t indices = 0;   ///< Tables of blocks and mesh units, except what map_bytes includes.
  size_t meshes = 0;    ///< On a GPU: the meshes extracted last.
  size_t scratch = 0;   ///< Buffers for processing a frame, kept for the next one.
  size_t staging = 0;   ///< With a GPU: buffers on the host.
  size_t space = 0;     ///< Cells and distances of space(), always on the host.
};

/// What clearRegion() removed.
struct ClearedRegion {
  size_t voxels = 0;  ///< Voxels that were not empty, counted per direction.
  size_t blocks = 0;  ///< Blocks freed because they became empty.
};

/// A map: depth frames are fused into it, colour images are painted on it, and meshes are extracted
/// from it.
///
/// Not thread safe: call from one thread at a time. Mappers are independent of each other. With
/// equal settings, equal frames in equal order give equal maps and meshes, bit for bit, on any
/// backend and thread count, unless a GPU runs out of memory.
class Mapper {
 public:
  virtual ~Mapper() = default;

  /// Fuses a frame. A bad frame leaves the map unchanged, and the result's status says why.
  /// @throws std::exception when the backend fails (a CUDA error, out of host memory).
  virtual IntegrationResult integrate(const DepthFrame& frame) = 0;

  /// Finds the pose at which a frame fits the map best, near its own T_W_C. The prior describes the
  /// expected error of T_W_C. The map is unchanged; integrate() the frame at the pose found.
  /// @return the pose found. For a frame that integrate() would refuse, or if a GPU lacks memory:
  /// kUnmapped and its own pose.
  /// @throws std::exception when the backend fails.
  virtual Alignment align(const DepthFrame& frame, const PosePrior& prior) = 0;

  /// Paints the surfaces of the map that are visible in a colour image. Only surfaces already in
  /// the map are painted, so fuse the depth frames that show them first. The back of a thin plate
  /// keeps its own colour, and surfaces that other parts of the map hide from the camera are not
  /// painted. Colour costs no time or memory if this is never called.
  /// @throws std::exception when the backend fails.
  virtual IntegrationResult paint(const ColourFrame& frame) = 0;

  /// Renders the surfaces of the map that face a camera: those of an up-to-date mesh without
  /// mesh/refine, whether or not it was extracted. The map is unchanged. Equal maps give equal
  /// bytes on every backend.
  /// @param camera Size and intrinsics of the images.
  /// @param T_W_C Optical frame to map frame, in metres.
  /// @param view Receives the images; its memory is reused, which saves time in a loop.
  /// @throws std::invalid_argument for a camera or a pose that integrate() would refuse;
  /// std::exception when the backend fails or, with map/page_folder, when the view needs more
  /// memory than the budget.
  virtual void render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                      RenderedView& view) = 0;

  /// Renders a view of the map into new images.
  RenderedView render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C) {
    RenderedView view;
    render(camera, T_W_C, view);
    return view;
  }

  /// Starts to mesh the blocks that changed since the last extraction. On a GPU, this returns
  /// before the work is done, and frames may be integrated meanwhile. Only one extraction runs at a
  /// time.
  /// @throws std::exception when the backend fails.
  virtual void beginMeshUpdate() = 0;

  /// Whether finishMeshUpdate() would return at once, as on a CPU. False if unknown.
  virtual bool isMeshMade() const { return false; }

  /// Waits for the extraction that was begun and returns its changes; empty if none was begun.
  /// @throws std::exception when the backend fails.
  virtual MeshUpdate finishMeshUpdate() = 0;

  /// Begins and finishes an extraction. Returns the meshes of all changed blocks, even where
  /// finishMeshUpdate() would return them in parts.
  MeshUpdate updateMesh();

  /// Empties all voxels in a region, in every direction, and removes their colours. Arrays and
  /// blocks that become empty are freed. The next mesh update contains the changes; an extraction
  /// already under way may still contain the region. Later frames may fill the region again.
  /// @throws std::invalid_argument for an invalid region (see findProblem()), leaving the map
  /// unchanged; PartlyCleared if blocks on disk cannot be read back; std::exception when the
  /// backend fails.
  virtual ClearedRegion clearRegion(const Region& region) = 0;

  /// Empties the map and discards any extraction under way. Clear the MeshStore too.
  virtual void clear() = 0;

  /// Copies the map, including all frames and images so far. The caller sets the name of the map
  /// frame and the stamp of the newest image.
  /// @throws std::exception when the backend fails (a CUDA error, out of host memory).
  virtual MapContents contents() = 0;

  /// Copies the map without voxels and colours. With outline() and part(), a map larger than memory
  /// (map/page_folder) can be copied piece by piece.
  /// @throws std::exception when the backend fails.
  virtual MapContents outline() = 0;

  /// Copies the voxels and colours of some blocks of outline(), given in the same order. @pre The
  /// map is unchanged since outline().
  /// @throws std::exception when the backend fails, or a block on disk cannot be read.
  virtual MapContents part(const std::vector<MapBlock>& blocks) = 0;

  /// Free space and distances to surfaces; null without space/enabled. The object lives as long as
  /// the mapper. Each call adds the free cells of the frames fused so far, so call it again after a
  /// frame. On a GPU it waits for the last frame.
  /// @throws std::exception when the backend fails.
  virtual Space* space() { return nullptr; }

  /// Size of the map after the last call that changed it. Does not wait for the device: on a GPU,
  /// what the last frame cleared or showed to be free is counted only after the next call that uses
  /// the map.
  virtual MapStats stats() const = 0;

  /// Memory that the mapper uses now in addition to map_bytes.
  virtual MapperMemory memory() const = 0;

  /// "cpu (2 threads)" or "cuda (name of the device)".
  virtual std::string backendName() const = 0;
};

/// Makes a mapper on the backend that `params.backend` selects.
/// @throws std::runtime_error if CUDA is required but cannot be used, or map/page_folder cannot be
/// written; the message says why.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params);

/// Makes a mapper that resumes from the contents of another, on any backend. Its first mesh update
/// contains the whole mesh.
/// @throws std::runtime_error like checkContents(), checkFits() and makeMapper(params), or if the
/// GPU has too little memory.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params, const MapContents& contents);

/// Why no CUDA mapper can be made on this machine; empty if one can.
std::string cudaUnavailableReason();

}  // namespace dtsdf
