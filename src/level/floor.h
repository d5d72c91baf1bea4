/// The floor among points that depth images show: the lowest large plane below the camera.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// With a unit normal to the side of the camera.
using FloorPlane = Eigen::Hyperplane<double, 3>;

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

/// A plane counts as the floor if its normal is within 45 degrees of the cameras' mean up, a
/// twentieth of all points lie on it, over more than a strip, and hardly any below. Of several, it
/// is the one with most points. The same points always give the same plane.
/// @param problem Why there is none; what to do is left to the caller.
std::optional<FloorPlane> fitFloor(const std::vector<FloorView>& views, std::string& problem);

/// Looks for the floor in depth images, a few at a time, until there is one. One thread at a time.
class FloorSearch {
 public:
  /// Images that are looked at together.
  static constexpr size_t kViews = 10;

  /// Looks at an image, whose pose is in the frame M; one without measurements or with a pose that
  /// is not finite does not count. True if the look is complete: floor() or problem() is new.
  bool add(const DepthFrame& frame);

  /// Ends a look that has begun, with the images that there were.
  void finish();

  /// In M, once there is one; what comes after that is not looked at.
  const std::optional<FloorPlane>& floor() const { return floor_; }

  /// Why the last look found none; empty before it was complete.
  const std::string& problem() const { return problem_; }

 private:
  std::vector<FloorView> views_;
  std::optional<FloorPlane> floor_;
  std::string problem_;
};

}  // namespace dtsdf
