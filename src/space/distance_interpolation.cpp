#include "space/distance_interpolation.h"

#include <cmath>

namespace dtsdf {
namespace {

/// Cells of the largest coordinates that a cube can have.
constexpr double kMostCell = static_cast<double>(kMaxBlockCoordinate) * kCubeSide;

double between(double low, double high, double share) { return low + share * (high - low); }

/// Of the cells `low` + (i & 1, i >> 1 & 1, i >> 2); mostly all are in one sector.
void findSquares(const DistanceSectors& sectors, const Vec3i& low, int (&squared)[8]) {
  const PackedKey key = packKey(sectorOfCell(low));
  const auto place = sectors.find(key);
  const auto sector = place == sectors.end() ? nullptr : place->second.get();
  const bool is_in_one = sector != nullptr && packKey(sectorOfCell(low + Vec3i{1, 1, 1})) == key;
  for (int i = 0; i < 8; ++i) {
    const Vec3i cell = low + Vec3i{i & 1, i >> 1 & 1, i >> 2};
    squared[i] = is_in_one ? sector->squaredAt(cell) : squaredAt(sectors, cell);
  }
}

}  // namespace

SpaceDistance interpolatedDistance(const KnownSpace& space, const DistanceSectors& sectors,
                                   int reach, const Eigen::Vector3d& p_W) {
  const double cell_m = space.cellSize_m(), most_m = reach * cell_m;
  SpaceDistance result;
  result.distance_m = static_cast<float>(-most_m);
  const Eigen::Vector3d in_cells = p_W / cell_m;
  if (!in_cells.allFinite() || in_cells.cwiseAbs().maxCoeff() > kMostCell - reach - 1.0) {
    return result;
  }
  const Eigen::Vector3d middles = in_cells - Eigen::Vector3d::Constant(0.5);
  const Eigen::Vector3d floor = middles.array().floor(), share = middles - floor;
  int squared[8];
  findSquares(sectors,
              {static_cast<int32_t>(floor.x()), static_cast<int32_t>(floor.y()),
               static_cast<int32_t>(floor.z())},
              squared);
  double d[2][2][2];
  bool is_limited = true;
  for (int i = 0; i < 8; ++i) {
    const double cells = squared[i] < 0 ? reach : std::sqrt(static_cast<double>(squared[i]));
    const double distance_m = cells * cell_m;
    d[i >> 2][i >> 1 & 1][i & 1] = distance_m;
    is_limited = is_limited && distance_m >= most_m;
  }
  const auto alongX = [&](int z, int y) { return between(d[z][y][0], d[z][y][1], share[0]); };
  const auto slopeX = [&](int z, int y) { return d[z][y][1] - d[z][y][0]; };
  const double y0 = between(alongX(0, 0), alongX(0, 1), share[1]),
               y1 = between(alongX(1, 0), alongX(1, 1), share[1]);
  result.known = space.stateOf(space.cellAt(p_W)) != CellState::kUnknown;
  const double sign = result.known ? 1.0 : -1.0, per_m = is_limited ? 0.0 : sign / cell_m;
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
