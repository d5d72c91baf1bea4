/// Reads recordings in folders through the FrameSource interface.
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
  std::optional<double> units_per_metre;  ///< Scale of 16-bit images; empty: the format's.
  /// Intrinsics to use instead of the format's. A negative fy means that the camera's y axis points
  /// up: rows are then flipped, and fy becomes positive.
  std::optional<Intrinsics> intrinsics;
  std::string poses_path;  ///< File or folder with poses to use instead of the recording's.
  /// Convention of the poses: "optical" (x right, y down, z forward), "opengl" (y up, z backwards),
  /// "body" (x forward, z up), or "inverted" (map to camera); empty: that of the file's format.
  std::string pose_convention;
  bool skip_bad = false;           ///< Images that cannot be decoded are skipped and counted.
  double pose_tolerance_s = 0.02;  ///< Largest time between an image and its nearest pose.
  /// For programs that track the camera: depth images need no poses, and all get the pose of the
  /// first selected image, or the identity. Colour images get poses in the depth camera's frame.
  bool first_pose_only = false;
  /// Images are not decoded: their `data` is null, only poses and cameras are set. Ignored for
  /// bags.
  bool poses_only = false;
  FrameSelection selection;  ///< Selected depth images.
  /// Selected colour images, by SourceColour::index, in rising order; null: all.
  std::shared_ptr<const std::vector<size_t>> listed_colours;
};

/// Names of the supported folder formats: tum, icl, 7scenes, replica, scannet, png.
std::vector<std::string> recordingFormats();

/// Detects the format of a recording: a name of recordingFormats(), or "bag".
/// @throws std::runtime_error if the path is missing or in no known format. For a folder, the
/// message says which files were expected, and names folders below it that contain recordings.
std::string guessRecordingFormat(const std::string& path);

/// Reads the folder's lists; images are decoded one by one.
/// @throws std::runtime_error for a missing or malformed file, which the message names, and for
/// bags, which the library does not read.
std::unique_ptr<FrameSource> openRecording(const RecordingOptions& options);

/// Values that neither the folder nor the options give, so the format's defaults are used: "the
/// camera of the format (--intrinsics), 1000 units per metre (--depth-scale)"; or empty.
std::string assumptionsOf(const RecordingOptions& options);

/// Opens the colour images of a recording, one of every FrameSelection::step; null if there are
/// none. Their camera is the format's colour camera, or else the depth camera; their poses are
/// taken at the stamps or numbers of the colour images.
/// @throws std::runtime_error as openRecording().
std::unique_ptr<ColourSource> openRecordingColours(const RecordingOptions& options);

}  // namespace dtsdf
