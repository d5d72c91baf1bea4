// ScanNet, as the reader of its .sens files exports it (github.com/ScanNet/ScanNet, SensReader):
// depth/NUMBER.png in millimetres, pose/NUMBER.txt with a 4 x 4 matrix from camera to world, all
// -inf where the tracker had lost the camera, and intrinsic/intrinsic_depth.txt, 4 x 4. Numbers
// have no leading zeros. Colour is in color/NUMBER.jpg, of a camera at the same place with another
// lens, which intrinsic/intrinsic_color.txt has.
#include "io/camera_file.h"
#include "io/colour_codes.h"
#include "io/depth_codes.h"
#include "io/formats/folder_format.h"
#include "io/formats/numbered_files.h"

namespace dtsdf {
namespace scannet {

namespace fs = std::filesystem;

bool isScanNet(const fs::path& folder) {
  return fs::is_directory(folder / "pose") && hasNumberedFile(folder / "depth", "", ".png");
}

std::vector<StampedImage> listDepth(const fs::path& folder) {
  return requireNumberedFiles(folder / "depth", "", ".png");
}

std::vector<ImagePose> findPoses(const fs::path& folder, const std::vector<StampedImage>& images,
                                 double) {
  std::vector<fs::path> paths;
  paths.reserve(images.size());
  for (const StampedImage& image : images) {
    paths.push_back(folder / "pose" / fs::path(image.path).stem().concat(".txt"));
  }
  return readPoseFiles(paths);
}

CameraInfo readCamera(const fs::path& folder, const std::vector<StampedImage>& images) {
  const std::string path = (folder / "intrinsic" / "intrinsic_depth.txt").string();
  const Eigen::MatrixXd matrix =
      readMatrixFile(path, 4, 4, "export it too, or give --intrinsics fx,fy,cx,cy");
  return cameraOfMatrix(matrix, readDepthPngSize(images.front().path), path);
}

double unitsPerMetre(const fs::path&) { return 1000.0; }

RecordedColours findColours(const fs::path& folder, const CameraInfo&) {
  RecordedColours colours;
  colours.images = listNumberedFiles(folder / "color", "", ".jpg");
  const std::string path = (folder / "intrinsic" / "intrinsic_color.txt").string();
  if (!fs::exists(path)) {
    colours.missing_camera = "no intrinsic/intrinsic_color.txt";
  } else if (!colours.images.empty()) {
    const RgbImage first = readColourImage(colours.images.front().path);
    colours.camera = cameraOfMatrix(readMatrixFile(path, 4, 4, "ScanNet has its camera there"),
                                    {first.width, first.height}, path);
  }
  return colours;
}

}  // namespace scannet

FolderFormat scanNetFormat() {
  using namespace scannet;
  return {"scannet",     "depth/NUMBER.png and pose/",
          isScanNet,     listDepth,
          findPoses,     readCamera,
          unitsPerMetre, findColours};
}

}  // namespace dtsdf
