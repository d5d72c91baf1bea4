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

/// What was done with a frame.
enum class FrameStatus {
  kFused,          ///< The image was fused, painted, or used only to clear space.
  kBadImage,       ///< No data, no pixels, too many pixels, overlapping rows, or an invalid unit.
  kBadIntrinsics,  ///< Not finite, or impossible for the size of the image.
  kBadPose,  ///< Not finite, not a rotation, or outside the coordinate range of a map; also if
             ///< keep_center_W is not finite.
  kNoMeasurement,  ///< No pixel has a depth that can be fused or used for clearing. For a colour
                   ///< image: no surface of the map is visible well enough to be painted.
  kNoMemory,  ///< The GPU has too little memory for this frame; further frames may still be fused.
};

/// Short description for messages ("bad pose").
const char* toString(FrameStatus status);

/// Result of integrate() or paint().
struct IntegrationResult {
  FrameStatus status = FrameStatus::kFused;  ///< The map is unchanged unless this is kFused.
  std::string message;        ///< The reason why the frame was not fused, or a warning.
  size_t refused_blocks = 0;  ///< Number of requests for blocks, voxel arrays or colour bricks that
                              ///< were refused for lack of memory.
  double duration_ms = 0.0;   ///< Wall time of the call.
};

/// The part of a map on disk, with map/page_folder. clear() resets the counters.
struct PageStats {
  size_t blocks = 0;       ///< Blocks on disk now.
  size_t bytes = 0;        ///< Disk space used by blocks.
  size_t space_bytes = 0;  ///< Disk space used by the cells and distances of space().
  size_t index_bytes = 0;  ///< Memory used by the index and by pending writes; not part of
                           ///< map_bytes.
  uint64_t written = 0;    ///< Blocks written.
  uint64_t read = 0;       ///< Blocks read back.
  uint64_t waits = 0;      ///< Number of waits for the disk of at least a millisecond.
  double wait_ms = 0.0;    ///< Total duration of these waits.
  /// Failed reads and writes, including writes when a page file or the disk was full.
  uint64_t failures = 0;
  /// Blocks, and sectors of 32 x 32 x 32 cells, that were lost because they were damaged on disk
  /// or, for sectors, unreadable when they had to be changed.
  uint64_t lost = 0;
  std::string problem;  ///< Description of the last failure; empty: none.
};

/// Size of a map.
struct MapStats {
  size_t blocks = 0;        ///< Blocks of 8 x 8 x 8 voxels in memory.
  size_t voxel_arrays = 0;  ///< Arrays of 512 voxels in memory: one per direction of a block.
  /// Bytes of blocks, arrays and colours in memory. At most max_map_bytes; see there for an
  /// exception.
  size_t map_bytes = 0;
  /// Requests for memory that were refused since the start or the last clear().
  uint64_t refused_blocks = 0;
  /// Part of map_bytes used for colours; 0 until the map is first painted.
  size_t colour_bytes = 0;
  /// Blocks dropped because of map/keep_radius_m since the start or the last clear().
  uint64_t dropped_blocks = 0;
  size_t free_bytes = 0;  ///< Part of the budget used by the free cells of space(), in bytes.
  /// How often, since the start or the last clear(), a cube of 8 x 8 x 8 cells with newly observed
  /// free cells was refused for lack of budget.
  uint64_t refused_cubes = 0;
  /// Limit of map_bytes: map/max_memory_mb, less an eighth with space/enabled. With
  /// map/page_folder, map_bytes may exceed it while an image that needs more is processed.
  size_t max_map_bytes = 0;
  size_t map_bytes_peak = 0;  ///< Largest map_bytes since the start or the last clear().
  PageStats pages;            ///< All 0 without map/page_folder.
};

/// Memory in bytes that a mapper has allocated in addition to MapStats::map_bytes. It does not
/// count towards the budget: only map_bytes and the budget determine which blocks are refused.
struct MapperMemory {
  bool on_gpu = false;  ///< Whether the map and everything listed here except `staging` and `space`
                        ///< is on a GPU.
  size_t spare = 0;     ///< Memory reserved for future voxels and colours.
  size_t indices = 0;   ///< Tables of blocks and mesh units, as far as not included in map_bytes.
  size_t meshes = 0;    ///< On a GPU: the meshes from the last extraction.
  size_t scratch = 0;   ///< Buffers for processing a frame, kept for the next one.
  size_t staging = 0;   ///< With a GPU: transfer buffers on the host.
  size_t space = 0;     ///< Cells and distances of space(), always on the host.
};

/// What clearRegion() removed.
struct ClearedRegion {
  size_t voxels = 0;  ///< Voxels that were not empty, counted per direction.
  size_t blocks = 0;  ///< Blocks that became empty and were freed.
};

/// A map: depth frames are fused into it, colour images are painted on it, and meshes are extracted
/// from it.
///
/// Not thread safe: call from one thread at a time. Mappers are independent of each other. With the
/// same settings, the same frames in the same order give identical maps and meshes, bit for bit, on
/// any backend and with any number of threads, unless a GPU runs out of memory.
class Mapper {
 public:
  virtual ~Mapper() = default;

  /// Fuses a frame. An invalid frame leaves the map unchanged; the status of the result gives the
  /// reason.
  /// @throws std::exception when the backend fails (a CUDA error, out of host memory).
  virtual IntegrationResult integrate(const DepthFrame& frame) = 0;

  /// Finds the pose near the frame's T_W_C at which the frame fits the map best. The prior
  /// describes the expected error of T_W_C. The map is not changed; call integrate() with the
  /// resulting pose to fuse the frame.
  /// @return the resulting pose; kUnmapped and the frame's own pose if integrate() would refuse the
  /// frame, or if a GPU lacks memory.
  /// @throws std::exception when the backend fails.
  virtual Alignment align(const DepthFrame& frame, const PosePrior& prior) = 0;

  /// Paints the surfaces of the map that are visible in a colour image. Only surfaces already in
  /// the map are painted, so fuse the depth frames of a scene first. The two sides of a thin plate
  /// keep separate colours, and surfaces occluded by other parts of the map are not painted. Colour
  /// costs no time or memory if this is never called.
  /// @throws std::exception when the backend fails.
  virtual IntegrationResult paint(const ColourFrame& frame) = 0;

  /// Renders the surfaces of the map that face a camera: those of an up-to-date mesh without
  /// mesh/refine, whether or not it was extracted. The map is not changed. Equal maps give equal
  /// bytes on every backend.
  /// @param camera Size and intrinsics of the images.
  /// @param T_W_C Optical frame to map frame, in metres.
  /// @param view Receives the images. Its memory is reused, which saves time in a loop.
  /// @throws std::invalid_argument for a camera or a pose that integrate() would refuse;
  /// std::exception when the backend fails or, with map/page_folder, when the view needs more
  /// memory than the budget allows.
  virtual void render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C,
                      RenderedView& view) = 0;

  /// Renders a view of the map into new images.
  RenderedView render(const RenderCamera& camera, const Eigen::Isometry3d& T_W_C) {
    RenderedView view;
    render(camera, T_W_C, view);
    return view;
  }

  /// Starts to mesh the blocks that changed since the last extraction. On a GPU, this returns
  /// before the work is done, and frames may be integrated in the meantime. Only one extraction
  /// runs at a time.
  /// @throws std::exception when the backend fails.
  virtual void beginMeshUpdate() = 0;

  /// Whether finishMeshUpdate() would return immediately, which it always does on a CPU. False if
  /// unknown.
  virtual bool isMeshMade() const { return false; }

  /// Waits for the extraction that was started and returns its changes; empty if none was started.
  /// @throws std::exception when the backend fails.
  virtual MeshUpdate finishMeshUpdate() = 0;

  /// Starts and finishes an extraction. Returns the meshes of all changed blocks, even if
  /// finishMeshUpdate() would return them in parts.
  MeshUpdate updateMesh();

  /// Empties all voxels in a region, in every direction, and removes their colours. Voxel arrays
  /// and blocks that become empty are freed. The next mesh update contains the changes; an
  /// extraction already under way may still return surfaces in the region. Frames fused afterwards
  /// may fill the region again.
  /// @throws std::invalid_argument for an invalid region (see findProblem()), leaving the map
  /// unchanged; PartlyCleared if blocks on disk cannot be read back; std::exception when the
  /// backend fails.
  virtual ClearedRegion clearRegion(const Region& region) = 0;

  /// Empties the map and discards any extraction under way. Clear the MeshStore too.
  virtual void clear() = 0;

  /// Copies the map, including all frames and images fused so far. The caller sets the name of the
  /// map frame and the stamp of the newest image.
  /// @throws std::exception when the backend fails (a CUDA error, out of host memory).
  virtual MapContents contents() = 0;

  /// Copies the map without voxels and colours. With outline() and part(), a map larger than memory
  /// (map/page_folder) can be copied piece by piece.
  /// @throws std::exception when the backend fails.
  virtual MapContents outline() = 0;

  /// Copies the voxels and colours of some of the blocks that outline() returned. @pre The blocks
  /// are in the order of outline(), and the map has not changed since.
  /// @throws std::exception when the backend fails, or a block on disk cannot be read.
  virtual MapContents part(const std::vector<MapBlock>& blocks) = 0;

  /// The free-space grid and the distances to surfaces; null without space/enabled. The object
  /// lives as long as the mapper. Each call adds the free cells of the frames fused so far, so call
  /// this again after each frame. On a GPU, the call waits for the last frame.
  /// @throws std::exception when the backend fails.
  virtual Space* space() { return nullptr; }

  /// Size of the map after the last call that changed it. Does not wait for the device: on a GPU,
  /// changes that the last frame made by clearing surfaces or adding free cells are included only
  /// after the next call that uses the map.
  virtual MapStats stats() const = 0;

  /// Memory that the mapper uses now in addition to map_bytes.
  virtual MapperMemory memory() const = 0;

  /// "cpu (2 threads)" or "cuda (name of the device)".
  virtual std::string backendName() const = 0;
};

/// Creates a mapper on the backend that `params.backend` selects.
/// @throws std::runtime_error if CUDA is required but cannot be used, or map/page_folder cannot be
/// written; the message says why.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params);

/// Creates a mapper that resumes from the contents of another mapper, on any backend. Its first
/// mesh update contains the whole mesh.
/// @throws std::runtime_error like checkContents(), checkFits() and makeMapper(params), or if the
/// GPU has too little memory.
std::unique_ptr<Mapper> makeMapper(const MapperParams& params, const MapContents& contents);

/// Why no CUDA mapper can be created on this machine; empty if one can be.
std::string cudaUnavailableReason();

}  // namespace dtsdf
