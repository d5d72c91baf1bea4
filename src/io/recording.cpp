#include "dtsdf_mapping/io/recording.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "io/depth_codes.h"
#include "io/formats/folder_format.h"
#include "io/pose_files.h"
#include "io/recorded_images.h"
#include "params/text.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

const FolderFormat* formatIn(const fs::path& folder) {
  for (const FolderFormat& format : folderFormats()) {
    const bool is_in = format.isIn ? format.isIn(folder) : !format.listDepth(folder).empty();
    if (is_in) return &format;
  }
  return nullptr;
}

/// The known formats: "tum (depth.txt), icl (associations.txt), ...".
std::string describeFormats() {
  std::string text;
  for (const FolderFormat& format : folderFormats()) {
    text += (text.empty() ? "" : ", ") + std::string(format.name) + " (" + format.marks + ")";
  }
  return text;
}

/// Names the recordings in a folder, as in "; it contains recordings: 'seq-01'"; empty if none.
std::string describeFolders(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory() && formatIn(entry.path()) != nullptr) {
      names.push_back(entry.path().filename().string());
    }
  }
  if (names.empty()) return "";
  std::sort(names.begin(), names.end());
  std::string text = "; it contains recordings:";
  for (const std::string& name : names) text += " '" + name + "'";
  return text;
}

const FolderFormat& formatNamed(const std::string& name) {
  for (const FolderFormat& format : folderFormats()) {
    if (name == format.name) return format;
  }
  throw std::runtime_error(
      "'" + name + "' is not a known recording format; known formats: " + describeFormats());
}

const FolderFormat& formatOf(const RecordingOptions& options) {
  return formatNamed(options.format.empty() ? guessRecordingFormat(options.path) : options.format);
}

void requireFolder(const std::string& path) {
  if (!fs::is_directory(path)) {
    throw std::runtime_error("'" + path +
                             "' is not a folder; give the folder of a recording, "
                             "and unpack archives first");
  }
}

/// Sorts images by stamp, since lists may be in any order.
void sortByStamp(std::vector<StampedImage>& images) {
  std::stable_sort(images.begin(), images.end(), [](const StampedImage& a, const StampedImage& b) {
    return a.stamp_s < b.stamp_s;
  });
}

/// @throws std::runtime_error if there are none.
std::vector<StampedImage> listDepth(const std::string& folder, const FolderFormat& format) {
  std::vector<StampedImage> images = format.listDepth(folder);
  sortByStamp(images);
  if (!images.empty()) return images;
  throw std::runtime_error("'" + folder + "' has no depth images; expected " + format.marks);
}

bool isReadable(const StampedImage& image) try {
  readDepthPngSize(image.path);
  return true;
} catch (const std::runtime_error&) {
  return false;
}

/// The camera from the options or the folder's files; std::nullopt if the format's usual camera is
/// to be used.
std::optional<CameraInfo> givenCamera(const RecordingOptions& options, const FolderFormat& format,
                                      std::vector<StampedImage> images) {
  if (options.skip_bad) {  // the image size may be read from the first image
    const auto first = std::find_if(images.begin(), images.end(), isReadable);
    if (first != images.end()) images = {*first};
  }
  if (options.intrinsics) {
    const DepthImage size = readDepthPngSize(images.front().path);
    return CameraInfo{size.width, size.height, *options.intrinsics};
  }
  return format.readCamera ? format.readCamera(options.path, images) : std::nullopt;
}

CameraInfo cameraOf(const RecordingOptions& options, const FolderFormat& format,
                    const std::vector<StampedImage>& images) {
  const std::optional<CameraInfo> given = givenCamera(options, format, images);
  return given ? *given : *format.usual_camera;
}

void findPoses(const RecordingOptions& options, const FolderFormat& format,
               const std::vector<StampedImage>& depth, std::vector<StampedImage>& images) {
  if (!options.poses_path.empty() || format.posesPath != nullptr) {
    return findPosesIn(
        options.poses_path.empty() ? format.posesPath(options.path) : options.poses_path,
        options.pose_tolerance_s, depth, images, options.pose_convention);
  }
  format.findPoses(options.path, options.pose_tolerance_s, images);
  convertToOptical(options.pose_convention, images);
}

/// Gives all images the pose of the first selected one, or the identity if it has none.
void findFirstPose(const RecordingOptions& options, const FolderFormat& format,
                   std::vector<StampedImage>& images) {
  size_t first = 0;
  while (first + 1 < images.size() && !options.selection.contains(first)) ++first;
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  try {
    findPoses(options, format, images, images);  // for all images, since poses may match by order
    T_W_C = images[first].T_W_C.value_or(T_W_C);
  } catch (const std::runtime_error&) {
    if (!options.poses_path.empty()) throw;  // the user named this file
  }
  for (StampedImage& image : images) image.T_W_C = T_W_C;
}

/// The depth scale from the options or the folder's files; std::nullopt if the format's usual scale
/// is to be used.
std::optional<double> givenUnits(const RecordingOptions& options, const FolderFormat& format) {
  if (options.units_per_metre || format.unitsOf == nullptr) return options.units_per_metre;
  return format.unitsOf(options.path);
}

double unitsOf(const RecordingOptions& options, const FolderFormat& format) {
  const double units = givenUnits(options, format).value_or(format.units_per_metre);
  if (units > 0.0 && std::isfinite(units)) return units;
  throw std::runtime_error("the depth scale must be above 0 units per metre");
}

}  // namespace

const std::vector<FolderFormat>& folderFormats() {
  static const std::vector<FolderFormat> formats{
      tumFormat(), iclFormat(), sevenScenesFormat(), replicaFormat(), scanNetFormat(), pngFormat()};
  return formats;
}

std::vector<std::string> recordingFormats() {
  std::vector<std::string> names;
  for (const FolderFormat& format : folderFormats()) names.push_back(format.name);
  return names;
}

std::string guessRecordingFormat(const std::string& path) {
  if (!fs::exists(path)) {
    throw std::runtime_error("'" + path + "': no such file or directory");
  }
  if (fs::is_regular_file(path) && fs::path(path).extension() == ".bag") return "bag";
  requireFolder(path);
  if (const FolderFormat* const format = formatIn(path)) return format->name;
  throw std::runtime_error(
      "'" + path + "' is not a recording in a known format" + describeFolders(path) +
      ". Known formats and their files: " + describeFormats() + "; select a format with --format");
}

std::unique_ptr<FrameSource> openRecording(const RecordingOptions& options) {
  requireFolder(options.path);
  const FolderFormat& format = formatOf(options);
  RecordedImages recorded;
  recorded.units_per_metre = unitsOf(options, format);
  recorded.images = listDepth(options.path, format);
  recorded.camera = cameraOf(options, format, recorded.images);
  if (options.first_pose_only) {
    findFirstPose(options, format, recorded.images);
  } else {
    findPoses(options, format, recorded.images, recorded.images);
  }
  return openRecordedImages(std::move(recorded), options);
}

std::string assumptionsOf(const RecordingOptions& options) {
  const FolderFormat& format = formatOf(options);
  std::vector<std::string> assumed;
  if (!givenCamera(options, format, listDepth(options.path, format))) {
    assumed.emplace_back("the format's usual camera (--intrinsics)");
  }
  if (!givenUnits(options, format)) {
    assumed.push_back(shortestText(unitsOf(options, format)) + " units per metre (--depth-scale)");
  }
  return joined(assumed);
}

std::unique_ptr<ColourSource> openRecordingColours(const RecordingOptions& options) {
  requireFolder(options.path);
  const FolderFormat& format = formatOf(options);
  const std::vector<StampedImage> depth = listDepth(options.path, format);
  RecordedImages recorded = format.findColours(options.path, cameraOf(options, format, depth));
  if (recorded.images.empty()) return nullptr;
  sortByStamp(recorded.images);
  if (!options.first_pose_only) findPoses(options, format, depth, recorded.images);
  for (StampedImage& image : recorded.images) {
    if (options.first_pose_only) image.T_W_C = Eigen::Isometry3d::Identity();
  }
  return openRecordedColours(std::move(recorded), options);
}

}  // namespace dtsdf
