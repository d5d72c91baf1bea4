/// Finds the floor in depth images: the lowest large plane below the camera.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// A floor plane, whose unit normal points towards the camera.
using FloorPlane = Eigen::Hyperplane<double, 3>;

/// Camera and points of one image, all in the same frame.
struct FloorView {
  struct Point {
    Eigen::Vector3d p;
    double tolerance_m;  ///< Largest distance from the surface caused by noise.
  };
  Eigen::Vector3d camera;     ///< Position of the camera.
  Eigen::Vector3d camera_up;  ///< Unit vector opposite to the optical frame's y axis.
  std::vector<Point> points;
};

/// Finds the floor: the plane with the most points among the planes tilted by less than 45 degrees
/// from the cameras' mean up vector. It must contain a twentieth of all points, be at least 0.3 m
/// wide, and have hardly any points below it. Deterministic.
/// @param problem Receives the reason why no floor was found; cleared if it was found.
std::optional<FloorPlane> fitFloor(const std::vector<FloorView>& views, std::string& problem);

/// Searches for the floor in batches of kViews depth images until it is found. Not thread-safe.
class FloorSearch {
 public:
  /// Number of images in one attempt.
  static constexpr size_t kViews = 10;

  /// Adds an image, with its pose in the frame M. Images without a finite pose, or without
  /// measurements within 6 m, are ignored. @return whether this completes an attempt, which updates
  /// floor() or problem().
  bool add(const DepthFrame& frame);

  /// Completes the current attempt with the images added so far.
  void finish();

  /// The floor in M, once found; further images are ignored.
  const std::optional<FloorPlane>& floor() const { return floor_; }

  /// Why the last attempt failed; empty if it succeeded, or if no attempt is complete yet.
  const std::string& problem() const { return problem_; }

 private:
  std::vector<FloorView> views_;
  std::optional<FloorPlane> floor_;
  std::string problem_;
};

}  // namespace dtsdf
