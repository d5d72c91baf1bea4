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
#include "io/map_box.h"
#include "io/trajectory.h"
#include "journal/replay.h"
#include "page/paged_meshes.h"

namespace dtsdf {

/// What is fused, and what is painted, if anything.
struct RecordedInput {
  RecordedInput(FrameSource& frames, ColourSource* images = nullptr,  // NOLINT: as it is mostly
                double images_per_s = 0.0)
      : depth(frames), colour(images), max_colour_rate_hz(images_per_s) {}
  FrameSource& depth;
  ColourSource* colour;
  double max_colour_rate_hz;  ///< Of what is painted; 0: all.
  /// Of the newest frame in the map that the run begins with: of the images before the first frame,
  /// those that come later are painted. None where the map is empty.
  std::optional<double> map_stamp_s;
  /// With --only: the account of frames; all images are painted, also those after the last frame,
  /// up to a stamp.
  struct OfBox {
    MapBox* box;
    double last_stamp_s;
    std::function<uint64_t()> supporting;  ///< Frames so far that touched a block.
  };
  std::optional<OfBox> of_box;
  PoseParams poses;  ///< Whether frames are fused at the poses given.
};

/// Who is handed frames and images.
struct InputVisitor {
  std::function<void(const SourceFrame&)> fuse;
  std::function<void(const SourceColour&)> paint;
  std::function<void()> finish_frame;  ///< After a frame and the images of its stamp.
};

/// Hands out frames and images in the order in which a map takes them: colour images by stamps
/// between the frames, those of one stamp after the frame; none after the last one, and none before
/// the first unless the run goes on with a map.
/// @return images left out, as more come than max_colour_rate_hz. @throws std::runtime_error
size_t visitInput(const RecordedInput& input, const InputVisitor& visitor);

/// How far refining moved the pose of an image, and what that brought.
struct PoseMove {
  double shift_m = 0.0, turn_rad = 0.0;
  double share_before = 0.0, share = 0.0;  ///< Of the image's points, those on surfaces of the map.
};

struct ReconstructionResult {
  size_t frames = 0;                            ///< Fused.
  size_t images = 0;                            ///< Painted.
  double stamp_s = 0.0;                         ///< Of the newest frame that was fused.
  std::map<std::string, size_t> skipped;        ///< Not fused, by reason.
  std::map<std::string, std::string> problems;  ///< The first message of a reason.
  std::vector<StampedPose> trajectory;          ///< Of the frames that were fused.
  std::map<std::string, size_t> aligned;  ///< Frames by how they were aligned, if they were to be.
  std::vector<PoseMove> moves;            ///< Of each frame that was refined.
  std::vector<double> align_ms;           ///< Wall time of each alignment.
  std::vector<double> integrate_ms;       ///< Wall time of each call, fused or refused.
  std::vector<double> paint_ms;           ///< Wall time of each colour image.
  std::vector<double> mesh_ms;            ///< Wall time of each extraction.
  MapStats map;
  std::shared_ptr<PagedMeshes> meshes;  ///< Of all blocks, on disk as the map is.
  size_t vertices = 0, triangles = 0;   ///< Of the mesh that is saved.
  std::string doubt;                    ///< What the poses seem to be instead; empty: nothing.
};

/// Fuses all frames of a source and paints the images, as visitInput() hands them out. The mesh is
/// extracted each `mesh_every` frames (0: never) and, of what is left, at the end. `show_progress`
/// is called with the number of frames done.
/// @throws std::runtime_error if the source or the backend fails, or if no frame was fused into a
/// map that is no box.
ReconstructionResult reconstruct(const RecordedInput& input, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// The same of a journal, with its calls in their order.
ReconstructionResult reconstruct(JournalReplay& journal, Mapper& mapper, const MapParams& map,
                                 size_t mesh_every,
                                 const std::function<void(size_t)>& show_progress);

/// "12 no pose within 20 ms, 3 no measurement (...)", with the messages that are known; empty if
/// nothing was skipped.
std::string describeSkipped(const std::map<std::string, size_t>& skipped,
                            const std::map<std::string, std::string>& problems = {});

}  // namespace dtsdf
