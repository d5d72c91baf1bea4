#include "space/distance_interpolation.h"

#include <cmath>

namespace dtsdf {
namespace {

/// Cells of the largest coordinates that a cube can have.
constexpr double kMostCell = static_cast<double>(kMaxBlockCoordinate) * kCubeSide;

double between(double low, double high, double share) { return low + share * (high - low); }

}  // namespace

std::optional<CellsAround> cellsAround(const Eigen::Vector3d& p_W, const DistanceUnits& units) {
  const Eigen::Vector3d in_cells = p_W / units.cell_size_m;
  if (!in_cells.allFinite() || in_cells.cwiseAbs().maxCoeff() > kMostCell - units.reach - 1.0) {
    return std::nullopt;
  }
  const Eigen::Vector3d middles = in_cells - Eigen::Vector3d::Constant(0.5);
  const Eigen::Vector3d floor = middles.array().floor();
  CellsAround around;
  around.low = {static_cast<int32_t>(floor.x()), static_cast<int32_t>(floor.y()),
                static_cast<int32_t>(floor.z())};
  for (int axis = 0; axis < 3; ++axis) around.share[axis] = middles[axis] - floor[axis];
  return around;
}

SpaceDistance unknownDistance(const DistanceUnits& units) {
  SpaceDistance result;
  result.distance_m = static_cast<float>(-units.reach * units.cell_size_m);
  return result;
}

SpaceDistance interpolate(const CellsAround& around, const int (&squared)[8], bool known,
                          const DistanceUnits& units) {
  const double most_m = units.reach * units.cell_size_m;
  double d[2][2][2];
  bool is_limited = true;
  for (int i = 0; i < 8; ++i) {
    const double cells = squared[i] < 0 ? units.reach : std::sqrt(static_cast<double>(squared[i]));
    const double distance_m = cells * units.cell_size_m;
    d[i >> 2][i >> 1 & 1][i & 1] = distance_m;
    is_limited = is_limited && distance_m >= most_m;
  }
  const double* const share = around.share;
  const auto alongX = [&](int z, int y) { return between(d[z][y][0], d[z][y][1], share[0]); };
  const auto slopeX = [&](int z, int y) { return d[z][y][1] - d[z][y][0]; };
  const double y0 = between(alongX(0, 0), alongX(0, 1), share[1]),
               y1 = between(alongX(1, 0), alongX(1, 1), share[1]);
  const double sign = known ? 1.0 : -1.0, per_m = is_limited ? 0.0 : sign / units.cell_size_m;
  SpaceDistance result;
  result.known = known;
  result.distance_m = static_cast<float>(sign * between(y0, y1, share[2]));
  result.gradient = {
      static_cast<float>(per_m * between(between(slopeX(0, 0), slopeX(0, 1), share[1]),
                                         between(slopeX(1, 0), slopeX(1, 1), share[1]), share[2])),
      static_cast<float>(
          per_m * between(alongX(0, 1) - alongX(0, 0), alongX(1, 1) - alongX(1, 0), share[2])),
      static_cast<float>(per_m * (y1 - y0))};
  return result;
}

}  // namespace dtsdf
