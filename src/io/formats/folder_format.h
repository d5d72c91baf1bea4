/// Folder layouts in which recordings are stored.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// A folder layout. Its functions throw std::runtime_error that names the file, if something is
/// missing or malformed.
struct FolderFormat {
  const char* name;   ///< Name for --format.
  const char* marks;  ///< Describes the files that identify this layout.

  /// Whether a folder has this layout. If null, a folder has this layout if listDepth() finds an
  /// image.
  bool (*isIn)(const std::filesystem::path& folder);

  /// Lists all depth images. In a layout without stamps, an image's number is its stamp.
  std::vector<StampedImage> (*listDepth)(const std::filesystem::path& folder);

  /// Finds the poses of depth or colour images. The tolerance applies to layouts that match poses
  /// by stamp. If null, findPosesIn() reads `posesPath`.
  void (*findPoses)(const std::filesystem::path& folder, double tolerance_s,
                    std::vector<StampedImage>& images);

  /// Reads the camera from the folder's files. If this is null or returns std::nullopt,
  /// `usual_camera` is used.
  std::optional<CameraInfo> (*readCamera)(const std::filesystem::path& folder,
                                          const std::vector<StampedImage>& images);

  /// Finds colour images, if the folder contains any, and their camera (the depth camera if the
  /// layout has only one camera), but not their poses.
  RecordedImages (*findColours)(const std::filesystem::path& folder,
                                const CameraInfo& depth_camera);

  double units_per_metre = 1000.0;
  /// Reads the depth units per metre from the folder's files. If this is null or returns
  /// std::nullopt, `units_per_metre` is used.
  std::optional<double> (*unitsOf)(const std::filesystem::path& folder) = nullptr;
  /// Camera for recordings that do not specify one.
  std::optional<CameraInfo> usual_camera = std::nullopt;
  /// The file or folder with the poses, in any format that findPosesIn() reads. If null,
  /// findPoses() is used.
  std::string (*posesPath)(const std::filesystem::path& folder) = nullptr;
};

/// All layouts. If several match a folder, the first one is used.
const std::vector<FolderFormat>& folderFormats();

// The individual layouts that folderFormats() lists.
FolderFormat tumFormat();
FolderFormat iclFormat();
FolderFormat sevenScenesFormat();
FolderFormat replicaFormat();
FolderFormat scanNetFormat();
FolderFormat pngFormat();

}  // namespace dtsdf
