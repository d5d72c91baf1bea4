// Fuzzes the readers of a recording's text files: lists of images, poses, matrices.
#include "fuzz/fuzz_input.h"
#include "io/camera_file.h"
#include "io/text_file.h"
#include "io/trajectory.h"
#include "io/tum_lists.h"

using namespace dtsdf;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const InputFile file(data, size);
  expectAnswer([&] {
    for (const ListLine& line : readList(file.path(), "give a list")) {
      for (size_t i = 0; i < line.words.size(); ++i) numberAt(line, i);
    }
  });
  expectAnswer([&] {
    const Trajectory trajectory = readTrajectory(file.path(), "give poses");
    for (const double stamp_s : {0.0, 1.0, 1.3e9, -1e300, 1e300}) trajectory.poseAt(stamp_s, 0.02);
  });
  expectAnswer([&] { rigidMotion(readMatrixFile(file.path(), 4, 4, "give a matrix")); });
  expectAnswer([&] {
    const Eigen::MatrixXd matrix = readMatrixFile(file.path(), 3, 3, "give a matrix");
    const CameraInfo camera = cameraOfMatrix(matrix, 640, 480, file.path());
    require(camera.intrinsics.fx > 0.0f, "fx above 0");
  });
  return 0;
}
