// A user's own images: 16-bit PNGs in millimetres, in depth/ or in the folder itself, sorted by the
// number at the end of their names. Poses are read from the first file or folder in kPoses that
// exists, intrinsics from one of three files (readCamera()), and colour images from a subfolder
// such as color/.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "io/camera_file.h"
#include "io/depth_codes.h"
#include "io/formats/folder_format.h"
#include "io/formats/numbered_files.h"
#include "io/pose_files.h"
#include "params/text.h"

namespace dtsdf {
namespace png {

namespace fs = std::filesystem;

constexpr const char* kPoses[] = {
    "poses",     "pose",       "transforms.json",     "trajectory.log", "traj.txt",
    "poses.txt", "images.txt", "sparse/0/images.txt", "groundtruth.txt"};

std::vector<StampedImage> imagesIn(const fs::path& folder,
                                   const std::vector<std::string>& endings) {
  auto images = listFiles(folder, [&](const fs::path& name) -> std::optional<double> {
    const bool is_image = std::any_of(endings.begin(), endings.end(), [&](const auto& ending) {
      return hasEnding(inLowerCase(name), ending);
    });
    return is_image ? std::optional(numberAtEnd(name).value_or(-1.0)) : std::nullopt;
  });
  // If any name has no number, all images are renumbered: first those without a number, sorted by
  // name, then the others, sorted by number.
  const bool lacks_numbers = !images.empty() && images.front().stamp_s < 0.0;
  for (size_t i = 0; lacks_numbers && i < images.size(); ++i) {
    images[i].stamp_s = static_cast<double>(i);
  }
  return images;
}

std::vector<StampedImage> listDepth(const fs::path& folder) {
  return imagesIn(fs::is_directory(folder / "depth") ? folder / "depth" : folder, {".png"});
}

std::string posesPath(const fs::path& folder) {
  for (const char* const name : kPoses) {
    if (fs::exists(folder / name)) return (folder / name).string();
  }
  throw std::runtime_error("'" + folder.string() + "' has no poses, such as poses.txt or " +
                           kPoses[2] +
                           "; give them with --poses, or track the camera with --poses-mode track");
}

/// Reads transforms.json. Its principal point is relative to the corner of the first pixel, not to
/// that pixel's centre.
std::optional<CameraInfo> cameraOfTransforms(const std::string& path, const DepthImage& size) try {
  const nlohmann::json root = readJsonFile(path, "expected intrinsics");
  for (const char* const list : {"depth_frames", "frames", ""}) {
    const nlohmann::json frames = root.value(list, nlohmann::json::array());
    const nlohmann::json& camera = frames.empty() ? root : frames.front();
    if (!camera.contains("fl_x")) continue;
    const auto number = [&](const char* key) { return camera.at(key).get<float>(); };
    return CameraInfo{size.width,
                      size.height,
                      {number("fl_x"), camera.value("fl_y", number("fl_x")), number("cx") - 0.5f,
                       number("cy") - 0.5f}};
  }
  return std::nullopt;
} catch (const nlohmann::json::exception& error) {
  throw std::runtime_error(path + ": " + error.what());
}

std::optional<CameraInfo> readCamera(const fs::path& folder,
                                     const std::vector<StampedImage>& images) {
  const std::string yaml = (folder / "camera_info.yaml").string();
  const std::string matrix = (folder / "camera-intrinsics.txt").string();
  const std::string transforms = (folder / "transforms.json").string();
  const DepthImage size = readDepthPngSize(images.front().path);
  if (fs::exists(matrix)) {
    return cameraOfMatrix(readMatrixFile(matrix, 3, 3, "expected intrinsics"), size.width,
                          size.height, matrix);
  }
  if (!fs::exists(yaml) && fs::exists(transforms)) {
    if (const auto camera = cameraOfTransforms(transforms, size)) return camera;
  }
  return loadCameraInfo(yaml);
}

RecordedImages findColours(const fs::path& folder, const CameraInfo& depth_camera) {
  RecordedImages colours{{}, colourCameraOf(folder, depth_camera)};
  for (const char* const name : {"color", "colour", "rgb", "images", "image"}) {
    if (colours.images.empty()) colours.images = imagesIn(folder / name, {".png", ".jpg", ".jpeg"});
  }
  return colours;
}

}  // namespace png

FolderFormat pngFormat() {
  using namespace png;
  return {"png",       "*.png, or depth/*.png",
          nullptr,     listDepth,
          nullptr,     readCamera,
          findColours, 1000.0,
          nullptr,     std::nullopt,
          posesPath};
}

}  // namespace dtsdf
