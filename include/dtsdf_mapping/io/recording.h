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
  std::string path;    ///< Of the folder.
  std::string format;  ///< One of recordingFormats(); empty: detected from its files.
  std::optional<double> units_per_metre;  ///< Of the 16-bit images; empty: as the format has it.
  /// Instead of the intrinsics of the format. With a negative fy the y axis points up: rows are
  /// flipped, and points stay where they are.
  std::optional<Intrinsics> intrinsics;
  std::string poses_path;          ///< A trajectory in TUM format, instead of the folder's poses.
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

/// The names of the folders' formats: tum, icl, 7scenes, replica, scannet.
std::vector<std::string> recordingFormats();

/// What a path is a recording of: a name of recordingFormats(), or "bag".
/// @throws std::runtime_error that says what is looked for, and where below the path it lies.
std::string guessRecordingFormat(const std::string& path);

/// Reads the folder's lists; images are decoded one by one.
/// @throws std::runtime_error for what is missing or malformed, with file and line. Bags are not
/// read by the library.
std::unique_ptr<FrameSource> openRecording(const RecordingOptions& options);

/// The colour images of the same folder, whatever depth images are selected; null if
/// it has none. They have a camera of their own if the layout has one, or else the depth
/// camera's, and the poses of their own stamps or numbers.
/// @throws std::runtime_error as openRecording().
std::unique_ptr<ColourSource> openRecordingColours(const RecordingOptions& options);

}  // namespace dtsdf
