/// The floor among points that depth images show: the lowest large plane below the camera.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace dtsdf {

/// The points p with normal . p = offset_m.
struct FloorPlane {
  Eigen::Vector3d normal;  ///< Unit, to the side of the camera.
  double offset_m;
};

/// What one image shows, all in one frame.
struct FloorView {
  struct Point {
    Eigen::Vector3d p;
    double tolerance_m;  ///< As far as noise may put it from the surface that it shows.
  };
  Eigen::Vector3d camera;     ///< Where the camera is.
  Eigen::Vector3d camera_up;  ///< The opposite of y in its optical frame; unit.
  std::vector<Point> points;
};

/// The plane, or why there is none.
struct FloorFit {
  std::optional<FloorPlane> floor;
  std::string problem;  ///< Without a floor; what to do is left to the caller.
};

/// A plane counts as the floor if its normal is within 45 degrees of the cameras' mean up, a
/// twentieth of all points lie on it, over more than a strip, and hardly any below. Of several, it
/// is the one with most points. The same points always give the same plane.
FloorFit fitFloor(const std::vector<FloorView>& views);

}  // namespace dtsdf
