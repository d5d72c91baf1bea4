#include "io/matrix_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "io/list_file.h"
#include "io/text_file.h"

namespace dtsdf {
namespace {

/// Trackers write decimals of single precision, and turn by turn their matrices drift a little.
constexpr double kRotationTolerance = 0.01;

/// "-inf", "nan", and "1.#INF" as Windows has it.
bool saysNotFinite(std::string word) {
  std::transform(word.begin(), word.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return word.find("inf") != std::string::npos || word.find("nan") != std::string::npos ||
         word.find(".#ind") != std::string::npos;
}

/// NaN for what is not finite, nothing for what is no number at all.
std::optional<double> parseElement(const std::string& word) {
  double number = 0.0;
  if (parseNumber(word, number) && std::isfinite(number)) return number;
  if (saysNotFinite(word)) return std::numeric_limits<double>::quiet_NaN();
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
    if (!number) throw std::runtime_error(expected + "'" + word + "' is none");
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

CameraInfo cameraOfMatrix(const Eigen::MatrixXd& matrix, ImageSize size, const std::string& place) {
  const Eigen::MatrixXf m = matrix.cast<float>();
  const Intrinsics K{m(0, 0), m(1, 1), m(0, 2), m(1, 2)};
  if (!m.allFinite() || !(K.fx > 0.0f && K.fy > 0.0f)) {
    throw std::runtime_error(place +
                             ": expected a matrix of intrinsics (fx 0 cx, 0 fy cy); or "
                             "give --intrinsics fx,fy,cx,cy");
  }
  return {size.width, size.height, K};
}

}  // namespace dtsdf
