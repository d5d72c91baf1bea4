/// Fuses a recording frame by frame, with statistics: the core of `reconstruct`.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"
#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/map_params.h"
#include "dtsdf_mapping/pose_refiner.h"
#include "dtsdf_mapping/pose_tracker.h"
#include "io/trajectory.h"
#include "journal/replay.h"
#include "page/paged_meshes.h"
#include "tools/boxes.h"

namespace dtsdf {

/// Depth images to fuse and, optionally, colour images with which to paint the map.
struct RecordedInput {
  RecordedInput(FrameSource& frames, ColourSource* images = nullptr,  // NOLINT: implicit
                double images_per_s = 0.0)
      : depth(frames), colour(images), max_colour_rate_hz(images_per_s) {}
  FrameSource& depth;
  ColourSource* colour;
  double max_colour_rate_hz;  ///< Maximum number of colour images to use per second; 0 for all.
  /// Stamp of the newest frame in the loaded map; nullopt if the run begins with an empty map.
  /// Colour images between that frame and the first frame of the run are used.
  std::optional<double> map_stamp_s;
  /// The box to build (--only); null for the whole map. The fused frames are listed in its MapBox.
  /// Colour images before the first frame, and after the last frame up to last_stamp_s, are used.
  BoxRun* box = nullptr;
  /// Returns the number of frames so far that have touched any block. Required if `box` is set.
  std::function<uint64_t()> supporting;
  int threads = 0;   ///< Number of threads for relocalising the camera; 0 for all cores.
  PoseParams poses;  ///< Whether poses are used unchanged, refined or tracked.
};

/// Consecutive images that were not fused because no pose was found.
struct LostRun {
  double from_s;            ///< Stamp of the first image.
  size_t fused_before = 0;  ///< Number of frames fused before the first image.
  size_t images = 0;        ///< Number of images.
  std::string why;          ///< Why no pose was found for the first image.
};

struct ReconstructionResult {
  size_t frames = 0;                      ///< Number of fused frames.
  size_t images = 0;                      ///< Number of colour images used for painting.
  double stamp_s = 0.0;                   ///< Stamp of the newest frame or colour image used.
  std::map<std::string, size_t> skipped;  ///< Number of frames and images not used, by reason.
  std::map<std::string, std::string> problems;  ///< First error message for each reason, if any.
  std::vector<StampedPose> trajectory;          ///< Poses of the fused frames.
  std::map<std::string, size_t> aligned;        ///< Number of frames by result of alignment.
  std::vector<LostRun> lost;
  /// Distance and angle between the input pose and the refined pose of each aligned frame.
  std::vector<double> shift_mm, turn_degrees;
  /// Fraction of a frame's points that lie on surfaces of the map, averaged over aligned frames: at
  /// the refined pose, and at the input pose with the correction from earlier frames.
  double on_surfaces = 0.0, on_surfaces_before = 0.0;
  std::vector<double> align_ms;      ///< Wall time per alignment.
  std::vector<double> integrate_ms;  ///< Wall time per integrated frame, fused or rejected.
  std::vector<double> paint_ms;      ///< Wall time per colour image.
  std::vector<double> mesh_ms;       ///< Wall time per mesh extraction.
  MapStats map;
  /// Meshes of all blocks, possibly partly on disk; null for a box.
  std::shared_ptr<PagedMeshes> meshes;
  size_t vertices = 0, triangles = 0;  ///< Size of the saved or reported mesh.
  std::string doubt;  ///< Warning if the poses seem to follow a different convention, or empty.
};

/// Fuses all frames of the input and paints the map with the colour images in between, in order of
/// stamps; a frame precedes a colour image with an equal stamp. For images before the first and
/// after the last frame, see RecordedInput. Updates the mesh every `mesh_every` frames (0: never)
/// and, unless the map is a box, at the end. Calls `show_progress` with the number of frames read.
/// @throws std::runtime_error if the source or the backend fails, or if no frame was fused and the
/// map is not a box.
ReconstructionResult reconstruct(const RecordedInput& input, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// Rebuilds the map from a journal, the node's record of its input. Updates the mesh in the same
/// way.
ReconstructionResult reconstruct(JournalReplay& journal, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// Lists counts and reasons, as in "12 x no pose within 20 ms, 3 x bad image (MESSAGE)", with the
/// messages in `problems`. Returns an empty string if nothing was skipped.
std::string describeSkipped(const std::map<std::string, size_t>& skipped,
                            const std::map<std::string, std::string>& problems = {});

}  // namespace dtsdf
