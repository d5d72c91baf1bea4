#include "io/camera_info_file.h"

#include <cmath>
#include <stdexcept>

#include "io/text_file.h"
#include "io/yaml_text.h"

namespace dtsdf {
namespace {

[[noreturn]] void throwBad(const std::string& path, const std::string& problem) {
  throw std::runtime_error(path + ": " + problem +
                           "; write the file as camera_calibration does (image_width, "
                           "image_height, projection_matrix with 3 x 4 numbers)");
}

int readSize(const YAML::Node& root, const std::string& key, const std::string& path) {
  const YAML::Node node = root[key];
  int size = 0;
  if (!node || !node.IsScalar() || !parseNumber(node.Scalar(), size) || size <= 0) {
    throwBad(path, key + " must be a whole number above 0");
  }
  return size;
}

/// fx, fy, cx and cy of a row-major matrix with 3 rows; the elements share one place in both.
Intrinsics readMatrix(const YAML::Node& root, const std::string& key, size_t columns,
                      const std::string& path) {
  const YAML::Node data = root[key].IsMap() ? root[key]["data"] : YAML::Node();
  if (!data || !data.IsSequence() || data.size() != 3 * columns) {
    throwBad(path, key + "/data must be a list of " + std::to_string(3 * columns) + " numbers");
  }
  const auto element = [&](size_t row, size_t column) {
    const YAML::Node node = data[row * columns + column];
    double number = 0.0;
    if (!node.IsScalar() || !parseNumber(node.Scalar(), number) || !std::isfinite(number)) {
      throwBad(path, key + "/data contains something that is not a number");
    }
    return static_cast<float>(number);
  };
  const Intrinsics K{element(0, 0), element(1, 1), element(0, 2), element(1, 2)};
  if (!(K.fx > 0.0f && K.fy > 0.0f)) throwBad(path, key + ": focal lengths must be above 0");
  return K;
}

}  // namespace

CameraInfo loadCameraInfo(const std::string& path) {
  const std::string text =
      readTextFile(path,
                   "the camera's intrinsics are expected there, as camera_calibration writes "
                   "them; or give --intrinsics fx,fy,cx,cy");
  try {
    const YAML::Node root = loadYaml(text);
    if (!root.IsMap()) throwBad(path, "no intrinsics");
    CameraInfo info;
    info.width = readSize(root, "image_width", path);
    info.height = readSize(root, "image_height", path);
    const bool rectified = static_cast<bool>(root["projection_matrix"]);
    if (!rectified && !root["camera_matrix"]) throwBad(path, "no projection_matrix");
    info.intrinsics = rectified ? readMatrix(root, "projection_matrix", 4, path)
                                : readMatrix(root, "camera_matrix", 3, path);
    return info;
  } catch (const YAML::Exception& e) {
    throwBad(path, "line " + std::to_string(e.mark.line + 1) + ": " + e.msg);
  }
}

}  // namespace dtsdf
