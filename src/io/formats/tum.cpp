// The TUM RGB-D benchmark (cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats): depth.txt and
// groundtruth.txt with stamps of one clock, 16-bit depth in 1/5000 m, registered to colour, and
// rgb.txt. Folders whose depth is not registered have the colour camera in colour_info.yaml.
#include "io/formats/folder_format.h"

namespace dtsdf {
namespace tum {

namespace fs = std::filesystem;

bool isTum(const fs::path& folder) { return isTumFolder(folder.string()); }

std::vector<StampedImage> listDepth(const fs::path& folder) {
  return readTumDepthList(folder.string());
}

std::vector<ImagePose> findPoses(const fs::path& folder, const std::vector<StampedImage>& images,
                                 double tolerance_s) {
  return posesNear(readTumTrajectory(folder.string()), images, tolerance_s);
}

CameraInfo readCamera(const fs::path& folder, const std::vector<StampedImage>&) {
  return readTumCamera(folder.string());
}

double unitsPerMetre(const fs::path&) { return 5000.0; }

RecordedImages findColours(const fs::path& folder, const CameraInfo& depth_camera) {
  RecordedImages colours;
  colours.images = readTumColourList(folder.string());
  colours.camera = colourCameraOf(folder, depth_camera);
  return colours;
}

}  // namespace tum

FolderFormat tumFormat() {
  using namespace tum;
  return {"tum",         "depth.txt, or associations.txt with groundtruth.txt",
          isTum,         listDepth,
          findPoses,     readCamera,
          unitsPerMetre, findColours};
}

}  // namespace dtsdf
