/// The floor among points that depth images show: the lowest large plane below the camera.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

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
  const std::optional<FloorPlane>& floor() const { return fit_.floor; }

  /// Why the last look found none; empty before it was complete.
  const std::string& problem() const { return fit_.problem; }

 private:
  std::vector<FloorView> views_;
  FloorFit fit_;
};

}  // namespace dtsdf
