/// Recordings in folders, as downloaded, behind the FrameSource interface.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/io/colour_source.h"
#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// A folder with depth images and poses, and what is read of it.
struct RecordingOptions {
  std::string path;    ///< Path of the folder.
  std::string format;  ///< One of recordingFormats(); empty: detected from its files.
  std::optional<double> units_per_metre;  ///< Scale of 16-bit images; empty: the format's.
  /// Instead of the intrinsics of the format. With a negative fy the y axis points up: rows are
  /// flipped, and points stay where they are.
  std::optional<Intrinsics> intrinsics;
  std::string poses_path;  ///< Poses of a file or folder, instead of the folder's.
  /// What poses are of: "optical" (x right, y down, z forward), "opengl" (y up, z backwards),
  /// "body" (x forward, z up), or "inverted", from map to camera; empty: as their file's format has
  /// it.
  std::string pose_convention;
  bool skip_bad = false;           ///< Images that cannot be decoded are skipped and counted.
  double pose_tolerance_s = 0.02;  ///< The pose nearest in time may be this far from an image.
  /// For programs that track the camera: depth images need no poses, and all get that of the first
  /// one selected, or the identity. Colour images get poses in the depth camera's frame.
  bool first_pose_only = false;
  /// Images are not decoded: their `data` is null, and only poses and cameras are known. Bags are
  /// read all the same.
  bool poses_only = false;
  FrameSelection selection;  ///< Which depth images, by their place in the recording.
  /// Which colour images, by SourceColour::index, in rising order; null: all.
  std::shared_ptr<const std::vector<size_t>> listed_colours;
};

/// The names of the folders' formats: tum, icl, 7scenes, replica, scannet, png.
std::vector<std::string> recordingFormats();

/// What a path is a recording of: a name of recordingFormats(), or "bag".
/// @throws std::runtime_error that says what is looked for, and where below the path it lies.
std::string guessRecordingFormat(const std::string& path);

/// Reads the folder's lists; images are decoded one by one.
/// @throws std::runtime_error for what is missing or malformed, with file and line. Bags are not
/// read by the library.
std::unique_ptr<FrameSource> openRecording(const RecordingOptions& options);

/// What nothing in the folder or the options says, and the format's usual value is taken for:
/// "the camera of the format (--intrinsics), 1000 units per metre (--depth-scale)"; empty: nothing.
std::string assumptionsOf(const RecordingOptions& options);

/// The colour images of the same folder, one of each `step` of the selection; null if it has none.
/// They have a camera of their own if the layout has one, or else the depth camera's, and the poses
/// of their own stamps or numbers.
/// @throws std::runtime_error as openRecording().
std::unique_ptr<ColourSource> openRecordingColours(const RecordingOptions& options);

}  // namespace dtsdf
