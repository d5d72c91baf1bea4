#include <cmath>
#include <numeric>

#include "scenes/cases.h"
#include "scenes/plane_raster.h"
#include "scenes/scene_map.h"
#include "simulation/random.h"

namespace dtsdf {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSheet_m = 2.3 + kOff_m, kBehindSheet_m = 2.8 + kOff_m;
constexpr double kSweep_m = 0.2;
constexpr int kSights = 40;
/// Centre of a sheet. Its offset from the grid planes differs between the axes, so that no two
/// sides have the same position relative to the grid.
const Vector2d kOffGrid_m(kOff_m, 0.0061);

/// How far each side of a rectangle is displaced outwards, in metres.
struct Sides {
  double left = 0.0, right = 0.0, top = 0.0, bottom = 0.0;
};

/// A rectangle centred at the origin, with sides parallel to x and y.
struct Rectangle {
  double width_m, height_m;

  bool contains(const Vector2d& p, const Sides& off = {}) const {
    return p.x() > -0.5 * width_m - off.left && p.x() < 0.5 * width_m + off.right &&
           p.y() > -0.5 * height_m - off.top && p.y() < 0.5 * height_m + off.bottom;
  }
  double area() const { return width_m * height_m; }
  double rim() const { return 2.0 * (width_m + height_m); }
};

/// An infinitely thin sheet facing the camera. A slot of width 0 means no slot.
struct Sheet {
  Rectangle outline, slot;
  Vector2d centre_m = kOffGrid_m;

  bool hasSlot() const { return slot.width_m > 0.0; }
  bool contains(const Vector2d& p) const { return outline.contains(p - centre_m) && !isInSlot(p); }
  bool isInSlot(const Vector2d& p) const { return hasSlot() && slot.contains(p - centre_m); }
  double rim() const { return outline.rim() + (hasSlot() ? slot.rim() : 0.0); }
};

const Sheet kBoard{{0.6, 0.4}, {0.035, 0.2}};
const Sheet kBoardOnGrid{kBoard.outline, kBoard.slot, Vector2d::Zero()};

/// Standard deviations of two random errors: in a side's position in each image row or column, and
/// in the camera's position along each axis.
struct SightError {
  double outline_px, pose_m;
};

/// A camera with a Kinect's focal length and an image large enough to contain the board.
SceneCamera sightCamera() { return {240, 150, 525.0}; }

/// Random displacements of a rectangle's sides: left and right for each image row, top and bottom
/// for each image column.
class NoisySides {
 public:
  NoisySides(const SceneCamera& camera, double sigma_m, Random& random)
      : rows_(static_cast<size_t>(camera.height)), columns_(static_cast<size_t>(camera.width)) {
    for (Sides& row : rows_) {
      row.left = sigma_m * random.normal();
      row.right = sigma_m * random.normal();
    }
    for (Sides& column : columns_) {
      column.top = sigma_m * random.normal();
      column.bottom = sigma_m * random.normal();
    }
  }

  Sides at(int u, int v) const {
    const Sides& row = rows_[static_cast<size_t>(v)];
    const Sides& column = columns_[static_cast<size_t>(u)];
    return {row.left, row.right, column.top, column.bottom};
  }

 private:
  std::vector<Sides> rows_, columns_;
};

SceneView lookAtSheet(const Sheet& sheet, const Vector3d& eye, double outline_px, Random& random) {
  const SceneCamera camera = sightCamera();
  SceneView view{camera, lookAlongZ(eye), {}};
  view.depth_m.resize(static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height));
  const double sheet_m = kSheet_m - eye.z(), wall_m = kBehindSheet_m - eye.z();
  const double sigma_m = outline_px * sheet_m / camera.focal_px;
  const NoisySides outline(camera, sigma_m, random), slot(camera, sigma_m, random);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Vector2d p = view.point(u, v, sheet_m).head<2>() - sheet.centre_m;
      const bool hit = sheet.outline.contains(p, outline.at(u, v)) &&
                       !(sheet.hasSlot() && sheet.slot.contains(p, slot.at(u, v)));
      view.at(u, v) = static_cast<float>(hit ? sheet_m : wall_m);
    }
  }
  return view;
}

/// Random position errors whose mean is zero; a common shift would only move the map.
std::vector<Vector3d> drawShifts(double sigma_m, Random& random) {
  std::vector<Vector3d> shifts;
  for (int i = 0; i < kSights; ++i) {
    const double x = random.normal(), y = random.normal();
    shifts.push_back(sigma_m * Vector3d(x, y, random.normal()));
  }
  const Vector3d mean =
      std::accumulate(shifts.begin(), shifts.end(), Vector3d::Zero().eval()) / kSights;
  for (Vector3d& shift : shifts) shift -= mean;
  return shifts;
}

Surface sweepPast(const SceneSetup& setup, const Sheet& sheet, double sweep_m,
                  const SightError& error) {
  SceneMap map(setup);
  Random random(13);
  const std::vector<Vector3d> shifts = drawShifts(error.pose_m, random);
  for (int i = 0; i < kSights; ++i) {
    const double along = static_cast<double>(i) / (kSights - 1) - 0.5;
    const Vector3d eye = sweep_m * Vector3d(along, 0.05 * std::sin(0.7 * i), 0.0);
    SceneView view = lookAtSheet(sheet, eye, error.outline_px, random);
    view.T_W_C.pretranslate(shifts[static_cast<size_t>(i)]);
    map.fuse(view);
  }
  return map.surface();
}

/// Measures the mesh area outside the sheet and the sheet area missing from the mesh, each divided
/// by the length of the sheet's rim, and the percentage of the slot that the mesh covers.
std::vector<Figure> measure(const SceneSetup& setup, const Sheet& sheet, double sweep_m,
                            const SightError& error) {
  constexpr double kNear_m = 0.1, kCell_m = 0.00025;
  const Vector2d reach(0.5 * sheet.outline.width_m + kNear_m,
                       0.5 * sheet.outline.height_m + kNear_m);
  PlaneRaster raster({sheet.centre_m - reach, sheet.centre_m + reach}, kCell_m);
  raster.cover(partOf(sweepPast(setup, sheet, sweep_m, error),
                      [](const Vector3d& p) { return std::abs(p.z() - kSheet_m) < kNear_m; }));
  const double over_m2 = raster.areaWhere(
      [&](const Vector2d& p, bool covered) { return covered && !sheet.contains(p); });
  const double missing_m2 = raster.areaWhere(
      [&](const Vector2d& p, bool covered) { return !covered && sheet.contains(p); });
  const double max_mm = 100.0 * setup.voxel();
  std::vector<Figure> figures = {
      atMost("overhang", max_mm, "mm", 1000.0 * over_m2 / sheet.rim()),
      atMost("missing", max_mm, "mm", 1000.0 * missing_m2 / sheet.rim())};
  if (sheet.hasSlot()) {
    const double closed_m2 = raster.areaWhere(
        [&](const Vector2d& p, bool covered) { return covered && sheet.isInSlot(p); });
    figures.push_back(atMost("slot closed", 10.0, "%", 100.0 * closed_m2 / sheet.slot.area()));
  }
  return figures;
}

}  // namespace

void addOutlineCases(std::vector<SceneCase>& cases) {
  const auto add = [&](const std::string& variant,
                       const std::function<Sheet(const SceneSetup&)>& sheet, double sweep_m,
                       const SightError& error) {
    cases.push_back({"outlines", variant, true, [=](const SceneSetup& setup) {
                       return measure(setup, sheet(setup), sweep_m, error);
                     }});
  };
  const auto board = [](const SceneSetup&) { return kBoard; };
  const auto on_grid = [](const SceneSetup&) { return kBoardOnGrid; };
  add("exact", board, kSweep_m, {0.0, 0.0});
  add("exact, sides on grid planes", on_grid, kSweep_m, {0.0, 0.0});
  add("sides off by 1 px", board, kSweep_m, {1.0, 0.0});
  add("poses off by 3 mm", board, kSweep_m, {0.0, 0.003});
  add("poses off by 5 mm", board, kSweep_m, {0.0, 0.005});
  add("poses off by 5 mm, sides on grid planes", on_grid, kSweep_m, {0.0, 0.005});
  add("sides off by 1 px, poses by 5 mm", board, kSweep_m, {1.0, 0.005});
  add("the camera stands still", board, 0.0, {0.0, 0.0});
  add("slot of two voxels, poses off by 5 mm",
      [](const SceneSetup& setup) {
        return Sheet{kBoard.outline, {2.0 * setup.voxel(), kBoard.slot.height_m}};
      },
      kSweep_m, {0.0, 0.005});
  add("bar of two voxels, poses off by 5 mm",
      [](const SceneSetup& setup) {
        return Sheet{{2.0 * setup.voxel(), kBoard.outline.height_m}, {0.0, 0.0}};
      },
      kSweep_m, {0.0, 0.005});
}

}  // namespace dtsdf
