// Layouts with one pose file per image (a 4 x 4 matrix, camera to world), depth in millimetres, and
// a matrix of intrinsics.
//
// 7-Scenes (microsoft.com/en-us/research/project/rgb-d-dataset-7-scenes): frame-NUMBER.depth.png,
// with 65535 where nothing was measured, and frame-NUMBER.pose.txt. Its cameras are not calibrated:
// a single set of intrinsics is published for all of them. tsdf-fusion
// (github.com/andyzeng/tsdf-fusion-python) uses this layout with other cameras and a 3 x 3
// camera-intrinsics.txt next to the images. Colour is in frame-NUMBER.color.png or .jpg. In
// 7-Scenes, colour is not registered to depth and the colour camera's parameters are not published;
// the depth camera's intrinsics and pose are used instead, which are nearly correct.
//
// ScanNet, as exported by its SensReader (github.com/ScanNet/ScanNet): depth/NUMBER.png,
// pose/NUMBER.txt (all -inf where tracking was lost), and a 4 x 4 intrinsic/intrinsic_depth.txt.
// Numbers have no leading zeros. Colour images are color/NUMBER.jpg. They share the depth images'
// poses, but their intrinsics are in intrinsic/intrinsic_color.txt.
#include <utility>

#include "io/camera_file.h"
#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "io/formats/folder_format.h"
#include "io/formats/numbered_files.h"

namespace dtsdf {
namespace posed_images {

namespace fs = std::filesystem;

const CameraInfo kKinect{640, 480, {585.0f, 585.0f, 320.0f, 240.0f}};
const std::string kPrefix = "frame-";

/// @param fileOf Returns the path of an image's pose file.
template <class FileOf>
void readPoses(const FileOf& fileOf, std::vector<StampedImage>& images) {
  for (StampedImage& image : images) {
    const fs::path path = fileOf(fs::path(image.path));
    image.missing = "no pose file";
    if (!fs::exists(path)) continue;
    image.missing = "the pose is not a rigid motion, or tracking was lost";
    image.T_W_C = rigidMotion(readMatrixFile(path.string(), 4, 4, "expected a pose"));
  }
}

std::vector<StampedImage> listSevenScenes(const fs::path& folder) {
  return listNumberedFiles(folder, kPrefix, ".depth.png");
}

void posesOfSevenScenes(const fs::path&, double, std::vector<StampedImage>& images) {
  const auto fileOf = [](const fs::path& image) {  // depth or colour
    return image.parent_path() / image.stem().replace_extension(".pose.txt");
  };
  readPoses(fileOf, images);
}

std::optional<CameraInfo> cameraOfSevenScenes(const fs::path& folder,
                                              const std::vector<StampedImage>& images) {
  const fs::path path = folder / "camera-intrinsics.txt";
  if (!fs::exists(path)) return std::nullopt;
  const DepthImage size = readDepthPngSize(images.front().path);
  return cameraOfMatrix(readMatrixFile(path.string(), 3, 3, "expected the camera of tsdf-fusion"),
                        size.width, size.height, path.string());
}

RecordedImages coloursOfSevenScenes(const fs::path& folder, const CameraInfo& depth_camera) {
  RecordedImages colours{{}, depth_camera};
  for (const std::string ending : {".color.png", ".color.jpg"}) {
    for (StampedImage& image : listNumberedFiles(folder, kPrefix, ending)) {
      colours.images.push_back(std::move(image));
    }
  }
  return colours;
}

std::vector<StampedImage> listScanNet(const fs::path& folder) {
  return listNumberedFiles(folder / "depth", "", ".png");
}

bool isScanNet(const fs::path& folder) {
  return fs::is_directory(folder / "pose") && !listScanNet(folder).empty();
}

void posesOfScanNet(const fs::path& folder, double, std::vector<StampedImage>& images) {
  readPoses([&](const fs::path& image) { return folder / "pose" / image.stem().concat(".txt"); },
            images);
}

std::optional<CameraInfo> cameraOfScanNet(const fs::path& folder,
                                          const std::vector<StampedImage>& images) {
  const std::string path = (folder / "intrinsic" / "intrinsic_depth.txt").string();
  const DepthImage size = readDepthPngSize(images.front().path);
  return cameraOfMatrix(
      readMatrixFile(path, 4, 4, "export it too, or give --intrinsics fx,fy,cx,cy"), size.width,
      size.height, path);
}

RecordedImages coloursOfScanNet(const fs::path& folder, const CameraInfo&) {
  RecordedImages colours{listNumberedFiles(folder / "color", "", ".jpg")};
  const std::string path = (folder / "intrinsic" / "intrinsic_color.txt").string();
  if (!fs::exists(path)) {
    colours.missing_camera = "no intrinsic/intrinsic_color.txt";
  } else if (!colours.images.empty()) {
    const RgbImage first = readColourImage(colours.images.front().path);
    colours.camera = cameraOfMatrix(readMatrixFile(path, 4, 4, "expected ScanNet's colour camera"),
                                    first.width, first.height, path);
  }
  return colours;
}

}  // namespace posed_images

FolderFormat sevenScenesFormat() {
  using namespace posed_images;
  return {
      "7scenes",           "frame-NUMBER.depth.png", nullptr, listSevenScenes, posesOfSevenScenes,
      cameraOfSevenScenes, coloursOfSevenScenes,     1000.0,  nullptr,         kKinect};
}

FolderFormat scanNetFormat() {
  using namespace posed_images;
  return {"scannet",       "depth/NUMBER.png and pose/",
          isScanNet,       listScanNet,
          posesOfScanNet,  cameraOfScanNet,
          coloursOfScanNet};
}

}  // namespace dtsdf
