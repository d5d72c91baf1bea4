/// Reads recordings from folders through the FrameSource interface.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// A folder with depth images and poses, and how to read it.
struct RecordingOptions {
  std::string path;    ///< Path of the folder.
  std::string format;  ///< One of recordingFormats(); empty: detected from its files.
  std::optional<double> units_per_metre;  ///< Scale of 16-bit images; empty: that of the format.
  /// Intrinsics to use instead of those of the format. A negative fy means that the camera's y axis
  /// points up; rows are then flipped and fy is made positive.
  std::optional<Intrinsics> intrinsics;
  std::string poses_path;  ///< File or folder with poses to use instead of those in the recording.
  /// Convention of the poses: "optical" (x right, y down, z forward), "opengl" (y up, z backwards),
  /// "body" (x forward, z up), or "inverted" (map to camera); empty: that of the file's format.
  std::string pose_convention;
  bool skip_bad = false;           ///< Whether to skip (and count) images that cannot be decoded.
  double pose_tolerance_s = 0.02;  ///< Maximum time in seconds between an image and its nearest
                                   ///< pose.
  /// For programs that track the camera. Depth images then need no poses: they all get the pose of
  /// the first selected image, or the identity if it has none. Poses of colour images are relative
  /// to the depth camera.
  bool first_pose_only = false;
  /// Whether to read only poses and intrinsics. Images are then not decoded, and their `data` is
  /// null. Ignored for bags.
  bool poses_only = false;
  FrameSelection selection;  ///< The depth images to read.
  /// Indices (SourceColour::index) of the colour images to read, in ascending order; null: all.
  std::shared_ptr<const std::vector<size_t>> listed_colours;
};

/// Names of the supported folder formats: tum, icl, 7scenes, replica, scannet, png.
std::vector<std::string> recordingFormats();

/// Detects the format of a recording: one of recordingFormats(), or "bag".
/// @throws std::runtime_error if the path does not exist or its format is unknown. For a folder,
/// the message says which files were expected, and lists subfolders that contain recordings.
std::string guessRecordingFormat(const std::string& path);

/// Opens a recording and reads its lists of images and poses. Images are decoded one at a time by
/// next().
/// @throws std::runtime_error for a missing or malformed file, which the message names, and for
/// bags, which the library does not read.
std::unique_ptr<FrameSource> openRecording(const RecordingOptions& options);

/// Lists the values for which the defaults of the format are used because neither the folder nor
/// the options provide them: "the format's usual camera (--intrinsics), 1000 units per metre
/// (--depth-scale)". Empty if there are none.
std::string assumptionsOf(const RecordingOptions& options);

/// Opens the colour images of a recording, one in every FrameSelection::step; null if there are
/// none. Their intrinsics are those of the format's colour camera if it defines one, otherwise
/// those of the depth camera. Their poses are looked up by the stamp or index of the colour image.
/// @throws std::runtime_error as openRecording() does.
std::unique_ptr<ColourSource> openRecordingColours(const RecordingOptions& options);

}  // namespace dtsdf
