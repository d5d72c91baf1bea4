/// Fuses a recording frame by frame and keeps account of it: the work of `reconstruct`.
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

/// What is fused, and what is painted, if anything.
struct RecordedInput {
  RecordedInput(FrameSource& frames, ColourSource* images = nullptr,  // NOLINT: as it is mostly
                double images_per_s = 0.0)
      : depth(frames), colour(images), max_colour_rate_hz(images_per_s) {}
  FrameSource& depth;
  ColourSource* colour;
  double max_colour_rate_hz;  ///< Most images painted a second; 0: all.
  /// Stamp of the newest frame in the map that the run begins with; none where it is empty. Images
  /// between that frame and the first one of the run are painted.
  std::optional<double> map_stamp_s;
  /// With --only: gets the account of frames. All images are painted, also those after the last
  /// frame, up to a stamp.
  BoxRun* box = nullptr;
  std::function<uint64_t()> supporting;  ///< With a box: frames so far that touched a block.
  int threads = 0;                       ///< Threads to look for the camera in a map; 0: all cores.
  PoseParams poses;                      ///< Whether frames are fused at the poses given.
};

/// Images in a row that were not fused, as no pose was found for them.
struct LostRun {
  double from_s;            ///< Stamp of the first one.
  size_t fused_before = 0;  ///< Frames that were fused by then.
  size_t images = 0;
  std::string why;  ///< Reason for the first one, with the shares that were matched and that fit.
};

struct ReconstructionResult {
  size_t frames = 0;                            ///< Frames fused.
  size_t images = 0;                            ///< Images painted.
  double stamp_s = 0.0;                         ///< Stamp of the newest one fused or painted.
  std::map<std::string, size_t> skipped;        ///< Not fused, by reason.
  std::map<std::string, std::string> problems;  ///< The first message of a reason.
  std::vector<StampedPose> trajectory;          ///< Poses of the frames that were fused.
  std::map<std::string, size_t> aligned;  ///< Frames by how they were aligned, if they were to be.
  std::vector<LostRun> lost;
  /// How far each refined frame moved from its given pose.
  std::vector<double> shift_mm, turn_degrees;
  /// The mean share of the points of refined frames that lie on surfaces, as they are fused and
  /// before they were aligned, with the correction so far.
  double on_surfaces = 0.0, on_surfaces_before = 0.0;
  std::vector<double> align_ms;      ///< Wall time of each alignment.
  std::vector<double> integrate_ms;  ///< Wall time of each call, fused or refused.
  std::vector<double> paint_ms;      ///< Wall time of each colour image.
  std::vector<double> mesh_ms;       ///< Wall time of each extraction.
  MapStats map;
  std::shared_ptr<PagedMeshes> meshes;  ///< Meshes of all blocks, on disk as the map is.
  size_t vertices = 0, triangles = 0;   ///< In the mesh that is saved.
  std::string doubt;                    ///< What the poses seem to be instead; empty: nothing.
};

/// Fuses all frames of a source and paints the images between them: by stamps, those of one stamp
/// after the frame; none after the last one, and none before the first unless the run goes on with
/// a map. The mesh is extracted each `mesh_every` frames (0: never) and, of what is left, at the
/// end. `show_progress` is called with the number of frames done.
/// @throws std::runtime_error if the source or the backend fails, or if no frame was fused into a
/// map that is no box.
ReconstructionResult reconstruct(const RecordedInput& input, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// Fuses a journal in the same way, with its calls in their order.
ReconstructionResult reconstruct(JournalReplay& journal, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// "12 no pose within 20 ms, 3 no measurement (...)", with the messages that are known; empty if
/// nothing was skipped.
std::string describeSkipped(const std::map<std::string, size_t>& skipped,
                            const std::map<std::string, std::string>& problems = {});

}  // namespace dtsdf
