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

/// Frames to fuse, and images to paint, if any.
struct RecordedInput {
  RecordedInput(FrameSource& frames, ColourSource* images = nullptr,  // NOLINT: implicit
                double images_per_s = 0.0)
      : depth(frames), colour(images), max_colour_rate_hz(images_per_s) {}
  FrameSource& depth;
  ColourSource* colour;
  double max_colour_rate_hz;  ///< Maximum number of colour images to paint per second; 0 for all.
  /// Stamp of the newest frame in the map that the run begins with; nullopt if no map was loaded.
  /// Images between that frame and the first one of the run are painted.
  std::optional<double> map_stamp_s;
  /// Set with --only. The numbers of the fused frames are added to its MapBox. Images are also
  /// painted before the first and after the last frame, up to last_stamp_s.
  BoxRun* box = nullptr;
  /// Set with a box: returns the number of frames so far that touched a block.
  std::function<uint64_t()> supporting;
  int threads = 0;   ///< Number of threads that search for the camera; 0 for all cores.
  PoseParams poses;  ///< How poses are found: as given, refined or tracked.
};

/// Consecutive images that were not fused because no pose was found.
struct LostRun {
  double from_s;            ///< Stamp of the first image.
  size_t fused_before = 0;  ///< Frames fused before these images.
  size_t images = 0;
  std::string why;  ///< Reason for the first of these images, with shares of its points.
};

struct ReconstructionResult {
  size_t frames = 0;                      ///< Frames fused.
  size_t images = 0;                      ///< Images painted.
  double stamp_s = 0.0;                   ///< Stamp of the newest frame fused or image painted.
  std::map<std::string, size_t> skipped;  ///< Frames and images not used, by reason.
  std::map<std::string, std::string> problems;  ///< First message for each reason.
  std::vector<StampedPose> trajectory;          ///< Poses of the frames that were fused.
  std::map<std::string, size_t> aligned;        ///< Frames by result of alignment, if any.
  std::vector<LostRun> lost;
  /// How far each refined frame moved from its given pose.
  std::vector<double> shift_mm, turn_degrees;
  /// Mean share of the points of refined frames that lie on surfaces of the map: at the fused pose,
  /// and at the pose before alignment, which includes the correction so far.
  double on_surfaces = 0.0, on_surfaces_before = 0.0;
  std::vector<double> align_ms;      ///< Wall time of each alignment.
  std::vector<double> integrate_ms;  ///< Wall time of each frame, fused or rejected.
  std::vector<double> paint_ms;      ///< Wall time of each colour image.
  std::vector<double> mesh_ms;       ///< Wall time of each extraction.
  MapStats map;
  /// Meshes of all blocks, perhaps partly on disk; null for a box.
  std::shared_ptr<PagedMeshes> meshes;
  size_t vertices = 0, triangles = 0;  ///< In the mesh that is saved or reported.
  std::string doubt;  ///< Why the poses seem to follow another convention; empty if they do not.
};

/// Fuses all frames of a source and paints the images between them in order of their stamps; at
/// equal stamps, the frame comes first. RecordedInput says which images before the first frame and
/// after the last are painted. The mesh is updated every `mesh_every` frames (0: never) and, unless
/// the map is a box, at the end. `show_progress` is called with the number of frames done.
/// @throws std::runtime_error if the source or the backend fails, or if no frame was fused and the
/// map is not a box.
ReconstructionResult reconstruct(const RecordedInput& input, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// Fuses a journal by repeating its calls in order. Updates the mesh as for a recording.
ReconstructionResult reconstruct(JournalReplay& journal, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// "12 no pose within 20 ms, 3 no measurement (...)", with messages where known; empty if nothing
/// was skipped.
std::string describeSkipped(const std::map<std::string, size_t>& skipped,
                            const std::map<std::string, std::string>& problems = {});

}  // namespace dtsdf
