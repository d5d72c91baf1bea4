#include <cmath>

#include "simulation/scene.h"

namespace dtsdf {
namespace {

/// One for each face: -x, +x, -y, +y, -z, +z.
constexpr int kFaces = 6;
constexpr Paint kFacePaint[kFaces] = {{200, 60, 50},  {60, 90, 210},   {70, 170, 80},
                                      {225, 170, 60}, {150, 140, 130}, {230, 230, 225}};
constexpr Paint kRoundPaint{120, 70, 160};
constexpr double kSquare_m = 0.25;
constexpr double kDarkShade = 0.7;

/// The face of a box that a point lies on: the axis along which it is farthest out.
int faceOf(const Eigen::Vector3d& p, const Eigen::Vector3d& half_size) {
  int axis = 0;
  (p.cwiseAbs() - half_size).maxCoeff(&axis);
  return 2 * axis + (p[axis] > 0.0 ? 1 : 0);
}

struct BasePaint {
  Eigen::Vector3d p_W;

  Paint operator()(const Box& box) const {
    return kFacePaint[faceOf(box.T_W_B.inverse() * p_W, box.half_size_m)];
  }
  Paint operator()(const Room& room) const {
    const Eigen::Vector3d half = 0.5 * (room.max_W - room.min_W);
    return kFacePaint[faceOf(p_W - (room.min_W + half), half)];
  }
  template <class Shape>
  Paint operator()(const Shape&) const {
    return kRoundPaint;
  }
};

/// Whether a point lies in a dark square. Surfaces lie on whole quarters of a metre: a bit off, so
/// that none lies between two layers of squares.
bool isDark(const Eigen::Vector3d& p_W) {
  const Eigen::Vector3d square = ((p_W / kSquare_m).array() + 0.37).floor();
  return static_cast<long>(square.sum()) % 2 != 0;
}

}  // namespace

Paint paintAt(const Scene& scene, size_t shape, const Eigen::Vector3d& p_W) {
  Paint paint = std::visit(BasePaint{p_W}, scene.shapes()[shape]);
  if (!isDark(p_W)) return paint;
  for (uint8_t& channel : paint) {
    channel = static_cast<uint8_t>(std::lround(kDarkShade * channel));
  }
  return paint;
}

}  // namespace dtsdf
