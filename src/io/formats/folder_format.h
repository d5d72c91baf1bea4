/// The layouts in which recordings are published: what each has to give, and the table of them.
#pragma once

#include <filesystem>
#include <vector>

#include "io/recorded_images.h"

namespace dtsdf {

/// One layout of folders. Its functions are asked for a folder that is one, in this order, and
/// throw std::runtime_error with file and place for what is missing or malformed.
struct FolderFormat {
  const char* name;   ///< As --format has it.
  const char* marks;  ///< The files by which such a folder is known.

  bool (*isIn)(const std::filesystem::path& folder);  ///< Null: a folder with depth images is one.

  /// All depth images. Where a layout has no stamps, the number of an image is its
  /// stamp.
  std::vector<StampedImage> (*listDepth)(const std::filesystem::path& folder);

  /// Finds the poses of images, of depth or of colour. The tolerance is for layouts that match by
  /// stamps.
  void (*findPoses)(const std::filesystem::path& folder, double tolerance_s,
                    std::vector<StampedImage>& images);

  CameraInfo (*readCamera)(const std::filesystem::path& folder,
                           const std::vector<StampedImage>& images);

  /// Colour images and their camera, which is the depth camera where the layout has but one; no
  /// images where the folder has none. Without their poses.
  RecordedImages (*findColours)(const std::filesystem::path& folder,
                                const CameraInfo& depth_camera);

  double units_per_metre = 1000.0;  ///< Scale of depth.
  /// Reads the scale of depth from a folder's files; null where they do not say it.
  double (*unitsOf)(const std::filesystem::path& folder) = nullptr;
};

/// The table. A folder is of the first that it belongs to.
const std::vector<FolderFormat>& folderFormats();

// Its rows, each in a file of its own.
FolderFormat tumFormat();
FolderFormat iclFormat();
FolderFormat sevenScenesFormat();
FolderFormat replicaFormat();
FolderFormat scanNetFormat();
FolderFormat pngFormat();

}  // namespace dtsdf
