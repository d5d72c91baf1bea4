// 7-Scenes (microsoft.com/en-us/research/project/rgb-d-dataset-7-scenes): frame-NUMBER.depth.png in
// millimetres, 65535 where nothing is measured, and frame-NUMBER.pose.txt, a 4 x 4 matrix from
// camera to world. Its cameras are not calibrated; one set of intrinsics is published for all.
//
// tsdf-fusion (github.com/andyzeng/tsdf-fusion-python) has the same layout with other cameras, and
// camera-intrinsics.txt, a 3 x 3 matrix, beside the images.
//
// Colour is in frame-NUMBER.color.png, or .jpg. Of 7-Scenes it is not registered to depth, and as
// nothing is published of its camera, it is taken for the depth camera's, which is nearly right.
#include <utility>

#include "io/camera_file.h"
#include "io/depth_codes.h"
#include "io/formats/folder_format.h"
#include "io/formats/numbered_files.h"

namespace dtsdf {
namespace seven_scenes {

namespace fs = std::filesystem;

const CameraInfo kKinect{640, 480, {585.0f, 585.0f, 320.0f, 240.0f}, true};
const std::string kPrefix = "frame-", kDepthEnding = ".depth.png";
constexpr size_t kEndingLength = sizeof(".depth.png") - 1;  // that of .color.png, too

bool isSevenScenes(const fs::path& folder) {
  return hasNumberedFile(folder, kPrefix, kDepthEnding);
}

std::vector<StampedImage> listDepth(const fs::path& folder) {
  return requireNumberedFiles(folder, kPrefix, kDepthEnding);
}

std::vector<ImagePose> findPoses(const fs::path&, const std::vector<StampedImage>& images, double) {
  std::vector<fs::path> paths;
  paths.reserve(images.size());
  for (const StampedImage& image : images) {
    paths.push_back(image.path.substr(0, image.path.size() - kEndingLength) + ".pose.txt");
  }
  return readPoseFiles(paths);
}

CameraInfo readCamera(const fs::path& folder, const std::vector<StampedImage>& images) {
  const fs::path path = folder / "camera-intrinsics.txt";
  if (!fs::exists(path)) return kKinect;
  return cameraOfMatrix(readMatrixFile(path.string(), 3, 3, "tsdf-fusion has its camera there"),
                        readDepthPngSize(images.front().path), path.string());
}

double unitsPerMetre(const fs::path&) { return 1000.0; }

RecordedColours findColours(const fs::path& folder, const CameraInfo& depth_camera) {
  RecordedColours colours;
  for (const std::string ending : {".color.png", ".color.jpg"}) {
    for (StampedImage& image : listNumberedFiles(folder, kPrefix, ending)) {
      colours.images.push_back(std::move(image));
    }
  }
  colours.camera = depth_camera;
  return colours;
}

}  // namespace seven_scenes

FolderFormat sevenScenesFormat() {
  using namespace seven_scenes;
  return {"7scenes",     "frame-NUMBER.depth.png",
          isSevenScenes, listDepth,
          findPoses,     readCamera,
          unitsPerMetre, findColours};
}

}  // namespace dtsdf
