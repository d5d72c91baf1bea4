// The "TUM RGB-D compatible PNGs" of ICL-NUIM (doc.ic.ac.uk/~ahanda/VaFRIC/iclnuim.html):
// associations.txt pairs depth with colour by frame number, and *.gt.freiburg lists poses by frame
// number. In the living room recordings, poses start at number 1, so image 0 has no pose. Depth is
// in units of 1/5000 m.
//
// The y axis of the renderer's camera, and of its poses, points up: the published intrinsics have a
// negative fy.
#include <stdexcept>

#include "io/formats/folder_format.h"
#include "io/trajectory.h"
#include "io/tum_lists.h"
#include "params/text.h"

namespace dtsdf {
namespace icl {

namespace fs = std::filesystem;

const CameraInfo kRenderer{640, 480, {481.2f, -480.0f, 319.5f, 239.5f}};
const std::string kPosesEnding = ".gt.freiburg";

bool isIcl(const fs::path& folder) {
  return fs::is_regular_file(folder / "associations.txt") && !isTumFolder(folder);
}

std::vector<StampedImage> listDepth(const fs::path& folder) {
  return readAssociations(folder, "depth/");
}

void findPoses(const fs::path& folder, double, std::vector<StampedImage>& images) {
  std::vector<std::string> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string path = entry.path().string();
    if (hasEnding(path, kPosesEnding)) paths.push_back(path);
  }
  if (paths.size() != 1) {
    throw std::runtime_error("'" + folder.string() + "' contains " + std::to_string(paths.size()) +
                             " *.gt.freiburg files, expected exactly one; choose one with "
                             "--poses FILE");
  }
  const Trajectory trajectory = readTrajectory(paths[0], "expected poses of ICL-NUIM");
  for (StampedImage& image : images) {
    image.T_W_C = trajectory.poseAt(image.stamp_s, 0.0);
    image.missing = "no pose with the same number";
  }
}

RecordedImages findColours(const fs::path& folder, const CameraInfo& depth_camera) {
  return {readAssociations(folder, "rgb/"), depth_camera};
}

}  // namespace icl

FolderFormat iclFormat() {
  using namespace icl;
  return {"icl",   "associations.txt", isIcl,  listDepth, findPoses,
          nullptr, findColours,        5000.0, nullptr,   kRenderer};
}

}  // namespace dtsdf
