#include "io/camera_file.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "io/text_file.h"
#include "io/yaml_text.h"
#include "params/text.h"

namespace dtsdf {
namespace {

[[noreturn]] void throwBad(const std::string& path, const std::string& problem) {
  throw std::runtime_error(path + ": " + problem +
                           "; write the file in camera_calibration's format (image_width, "
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

/// Reads fx, fy, cx and cy from a row-major matrix of 3 x 3 or 3 x 4 numbers.
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
      throwBad(path, key + "/data must contain numbers only");
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
                   "expected the camera's intrinsics in the format of camera_calibration; "
                   "or give --intrinsics fx,fy,cx,cy");
  try {
    const YAML::Node root = loadYaml(text);
    if (!root.IsMap()) throwBad(path, "it contains no intrinsics");
    const int width = readSize(root, "image_width", path),
              height = readSize(root, "image_height", path);
    const bool rectified = static_cast<bool>(root["projection_matrix"]);
    if (!rectified && !root["camera_matrix"]) throwBad(path, "no projection_matrix");
    return {width, height,
            rectified ? readMatrix(root, "projection_matrix", 4, path)
                      : readMatrix(root, "camera_matrix", 3, path)};
  } catch (const YAML::Exception& e) {
    throwBad(path, "line " + std::to_string(e.mark.line + 1) + ": " + e.msg);
  }
}

namespace {

std::string matrixText(const std::string& name, size_t columns, const std::vector<float>& values) {
  std::string text = name + ":\n  rows: " + std::to_string(values.size() / columns) +
                     "\n  cols: " + std::to_string(columns) + "\n  data: [";
  for (size_t i = 0; i < values.size(); ++i) {
    text += formatted("%s%.9g", i == 0 ? "" : ", ", static_cast<double>(values[i]));
  }
  return text + "]\n";
}

}  // namespace

CameraInfo colourCameraOf(const std::filesystem::path& folder, const CameraInfo& depth_camera) {
  const std::filesystem::path own = folder / "colour_info.yaml";
  return std::filesystem::exists(own) ? loadCameraInfo(own.string()) : depth_camera;
}

std::string cameraInfoText(const CameraInfo& camera, const std::string& camera_name) {
  const Intrinsics& K = camera.intrinsics;
  return "image_width: " + std::to_string(camera.width) +
         "\nimage_height: " + std::to_string(camera.height) + "\ncamera_name: " + camera_name +
         "\n" + matrixText("camera_matrix", 3, {K.fx, 0, K.cx, 0, K.fy, K.cy, 0, 0, 1}) +
         "distortion_model: plumb_bob\n" +
         matrixText("distortion_coefficients", 5, {0, 0, 0, 0, 0}) +
         matrixText("rectification_matrix", 3, {1, 0, 0, 0, 1, 0, 0, 0, 1}) +
         matrixText("projection_matrix", 4, {K.fx, 0, K.cx, 0, 0, K.fy, K.cy, 0, 0, 0, 1, 0});
}

namespace {

/// Rotations in files are rounded, so they are not quite orthonormal.
constexpr double kRotationTolerance = 0.01;

/// Recognises "-inf" and "nan", and "1.#INF" and "1.#IND" as written on Windows.
bool isNonFiniteWord(const std::string& text) {
  const std::string word = inLowerCase(text);
  return word.find("inf") != std::string::npos || word.find("nan") != std::string::npos ||
         word.find(".#ind") != std::string::npos;
}

/// Parses a number; infinity becomes NaN. @return std::nullopt if the word is not a number.
std::optional<double> parseElement(const std::string& word) {
  double number = 0.0;
  if (parseNumber(word, number) && std::isfinite(number)) return number;
  if (isNonFiniteWord(word)) return std::numeric_limits<double>::quiet_NaN();
  return std::nullopt;
}

}  // namespace

Eigen::MatrixXd parseMatrix(const std::vector<std::string>& words, int rows, int columns,
                            const std::string& place) {
  const std::string expected = place + ": expected " + std::to_string(rows) + " x " +
                               std::to_string(columns) + " numbers, but ";
  if (words.size() != static_cast<size_t>(rows) * static_cast<size_t>(columns)) {
    throw std::runtime_error(expected + "there are " + std::to_string(words.size()));
  }
  Eigen::MatrixXd matrix(rows, columns);
  for (int i = 0; i < rows * columns; ++i) {
    const std::string& word = words[static_cast<size_t>(i)];
    const std::optional<double> number = parseElement(word);
    if (!number) throw std::runtime_error(expected + "'" + word + "' is not a number");
    matrix(i / columns, i % columns) = *number;
  }
  return matrix;
}

Eigen::MatrixXd readMatrixFile(const std::string& path, int rows, int columns,
                               const std::string& advice) {
  return parseMatrix(splitWords(readTextFile(path, advice)), rows, columns, path);
}

std::optional<Eigen::Isometry3d> rigidMotion(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  if (!matrix.allFinite() || !rotation.isUnitary(kRotationTolerance) ||
      rotation.determinant() < 0.0 || matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    return std::nullopt;
  }
  Eigen::Isometry3d T_W_C = Eigen::Isometry3d::Identity();
  T_W_C.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  T_W_C.translation() = matrix.topRightCorner<3, 1>();
  return T_W_C;
}

CameraInfo cameraOfMatrix(const Eigen::MatrixXd& matrix, int width, int height,
                          const std::string& place) {
  const Eigen::MatrixXf m = matrix.cast<float>();
  const Intrinsics K{m(0, 0), m(1, 1), m(0, 2), m(1, 2)};
  if (!m.allFinite() || !(K.fx > 0.0f && K.fy > 0.0f)) {
    throw std::runtime_error(place +
                             ": expected a matrix of intrinsics (fx 0 cx, 0 fy cy); or "
                             "give --intrinsics fx,fy,cx,cy");
  }
  return {width, height, K};
}

}  // namespace dtsdf
