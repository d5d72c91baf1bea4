#include "io/tum_lists.h"

#include <filesystem>
#include <stdexcept>

#include "io/formats/folder_format.h"
#include "io/text_file.h"
#include "io/trajectory.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

const char* const kAdvice = "a TUM folder contains depth.txt, groundtruth.txt and camera_info.yaml";

/// The driver registered the benchmark's depth images to colour but did not rectify them. The
/// benchmark recommends the driver's default intrinsics, without undistortion, for all cameras
/// (cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats).
const CameraInfo kFreiburgCamera{640, 480, {525.0f, 525.0f, 319.5f, 239.5f}};

std::vector<StampedImage> readImageList(const fs::path& path) {
  std::vector<StampedImage> images;
  for (const ListLine& line : readList(path.string(), kAdvice)) {
    if (line.words.size() != 2) throwAt(line, "expected 'stamp file'");
    images.push_back({numberAt(line, 0), (path.parent_path() / line.words[1]).string()});
  }
  return images;
}

/// The benchmark's lists begin with a comment that names the recording, such as
/// # file: 'rgbd_dataset_freiburg1_...'
bool mentionsFreiburg(const fs::path& list) {
  if (!fs::is_regular_file(list)) return false;
  std::istringstream text(readTextFile(list.string(), kAdvice));
  for (std::string line; std::getline(text, line) && line.rfind('#', 0) == 0;) {
    if (line.find("freiburg") != std::string::npos) return true;
  }
  return false;
}

bool isBenchmarkRecording(const fs::path& folder) {
  return fs::canonical(folder).filename().string().find("freiburg") != std::string::npos ||
         mentionsFreiburg(folder / "depth.txt") || mentionsFreiburg(folder / "groundtruth.txt");
}

}  // namespace

std::vector<StampedImage> readAssociations(const fs::path& folder, const std::string& kind) {
  std::vector<StampedImage> images;
  const fs::path path = folder / "associations.txt";
  for (const ListLine& line : readList(path.string(), "expected a list of images")) {
    const size_t i = line.words.size() == 4 && line.words[1].rfind(kind, 0) == 0 ? 1 : 3;
    if (line.words.size() != 4 || line.words[i].rfind(kind, 0) != 0) {
      throwAt(line, "expected 'stamp depth/FILE stamp rgb/FILE'");
    }
    images.push_back({numberAt(line, i - 1), (path.parent_path() / line.words[i]).string()});
  }
  if (images.empty()) throw std::runtime_error(path.string() + ": lists no depth image");
  return images;
}

bool isTumFolder(const fs::path& folder) {
  const auto has = [&](const char* name) { return fs::is_regular_file(folder / name); };
  return has("depth.txt") ||
         (has("associations.txt") && (has("groundtruth.txt") || has("camera_info.yaml")));
}

std::vector<StampedImage> readTumDepthList(const fs::path& folder) {
  const fs::path path = folder / "depth.txt";
  if (!fs::exists(path) && isTumFolder(folder)) return readAssociations(folder, "depth/");
  std::vector<StampedImage> images = readImageList(path);
  if (images.empty()) throw std::runtime_error(path.string() + ": lists no depth image");
  return images;
}

std::vector<StampedImage> readTumColourList(const fs::path& folder) {
  const fs::path path = folder / "rgb.txt";
  if (fs::exists(path)) return readImageList(path);
  const bool has_depth_list = fs::exists(folder / "depth.txt");
  return has_depth_list ? std::vector<StampedImage>{} : readAssociations(folder, "rgb/");
}

Trajectory readTumTrajectory(const fs::path& folder) {
  return readTrajectory((folder / "groundtruth.txt").string(), kAdvice);
}

std::optional<CameraInfo> readTumCamera(const fs::path& folder) {
  const fs::path path = folder / "camera_info.yaml";
  if (!fs::exists(path) && isBenchmarkRecording(folder)) return std::nullopt;
  return loadCameraInfo(path.string());
}

namespace {

void findPoses(const fs::path& folder, double tolerance_s, std::vector<StampedImage>& images) {
  findPosesNear(readTumTrajectory(folder), tolerance_s, images);
}

std::optional<CameraInfo> cameraOfFolder(const fs::path& folder, const std::vector<StampedImage>&) {
  return readTumCamera(folder);
}

RecordedImages findColours(const fs::path& folder, const CameraInfo& depth_camera) {
  return {readTumColourList(folder), colourCameraOf(folder, depth_camera)};
}

}  // namespace

/// The TUM RGB-D benchmark (cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats): depth.txt and
/// groundtruth.txt with stamps from one clock, rgb.txt, and 16-bit depth in units of 1/5000 m,
/// registered to colour. If depth is not registered to colour, colour_info.yaml describes the
/// colour camera.
FolderFormat tumFormat() {
  return {"tum",       "depth.txt, or associations.txt with groundtruth.txt",
          isTumFolder, readTumDepthList,
          findPoses,   cameraOfFolder,
          findColours, 5000.0,
          nullptr,     kFreiburgCamera};
}

}  // namespace dtsdf
