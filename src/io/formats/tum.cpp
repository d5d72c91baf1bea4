// The TUM RGB-D benchmark (cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats): depth.txt and
// groundtruth.txt with stamps of one clock, 16-bit depth in 1/5000 m, registered to colour.
#include "io/formats/folder_format.h"

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

bool isTum(const fs::path& folder) { return fs::is_regular_file(folder / "depth.txt"); }

std::vector<StampedImage> listDepth(const fs::path& folder) {
  return readTumDepthList(folder.string());
}

std::vector<ImagePose> findPoses(const fs::path& folder, const std::vector<StampedImage>& images,
                                 double tolerance_s) {
  return posesByStamp(readTumTrajectory(folder.string()), images, tolerance_s);
}

CameraInfo readCamera(const fs::path& folder, const std::vector<StampedImage>&) {
  return readTumCamera(folder.string());
}

double unitsPerMetre(const fs::path&) { return 5000.0; }

}  // namespace

FolderFormat tumFormat() {
  return {"tum", "depth.txt", isTum, listDepth, findPoses, readCamera, unitsPerMetre};
}

}  // namespace dtsdf
