/// Metrics for the free cells and distances of a map, compared with the truth in analytic scenes.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "dtsdf_mapping/space.h"
#include "evaluation/space_scenes.h"

namespace dtsdf {

/// The truth about a scene viewed by cameras. A surface point counts as visible if, in some image,
/// it is not occluded and at least 3 pixels from the image border.
class SpaceTruth {
 public:
  explicit SpaceTruth(ViewedScene viewed) : viewed_(std::move(viewed)) {}

  /// Distance to the nearest surface; empty if the nearest point on it is not visible in any image.
  std::optional<double> distanceFrom(const Eigen::Vector3d& p_W) const;

  /// Whether a solid extends into a box.
  bool isTaken(const Eigen::AlignedBox3d& box_W) const;

  /// Whether all of a box is in front of the surfaces in some view, and within `max_range_m`. This
  /// is tested on a grid of points that includes the corners.
  bool isSeenThrough(const Eigen::AlignedBox3d& box_W, double max_range_m) const;

 private:
  bool isSeen(const Eigen::Vector3d& p_W) const;
  bool isClear(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const;

  ViewedScene viewed_;
};

/// Errors in distances: distance in the map minus true distance.
struct DistanceErrors {
  size_t count = 0;
  double rmse_m = 0.0, mean_m = 0.0, least_m = 0.0, greatest_m = 0.0;
  size_t far_off = 0;  ///< Number of distances that are off by more than kFarOff_cells.
};

struct SpaceFigures {
  double cell_m = 0.0;
  size_t free_cells = 0, surface_cells = 0;
  DistanceErrors at_middles;  ///< Errors in the distances at the centres of known cells.
  DistanceErrors at_points;   ///< Errors in distanceAt() at a random point in each known cell.
  size_t looked_at = 0;       ///< Number of free cells of the map that were checked.
  size_t taken = 0;           ///< Checked cells into which a solid extends.
  size_t unseen = 0;          ///< Checked cells that no view observes to be entirely free.
  /// Random cells that contain no solid and are entirely free in some view.
  size_t truly_free = 0;
  size_t found_free = 0;  ///< Truly free cells that are free in the map.
};

struct SpaceQuestions {
  double max_distance_m;    ///< Distances are compared up to this value.
  double max_range_m;       ///< Maximum depth at which views mark cells as free.
  size_t samples = 100000;  ///< Maximum number of cells sampled per metric.
};

/// Free cells are shrunk by this much on all sides before they are compared with solids and views,
/// to allow for rounding.
constexpr double kBoxMargin_m = 1e-3;

/// Distances should not be off by more than this.
constexpr double kFarOff_cells = 1.5;

/// Measures the free cells and distances of a map, on all cores. @pre Distances are up to date.
SpaceFigures measureSpace(const Space& space, const SpaceTruth& truth,
                          const SpaceQuestions& questions);

std::string toJson(const SpaceFigures& figures);

}  // namespace dtsdf
