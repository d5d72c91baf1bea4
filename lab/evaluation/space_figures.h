/// Figures that compare a map's free space and distances with the truth, in analytic scenes.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "dtsdf_mapping/space.h"
#include "evaluation/space_scenes.h"

namespace dtsdf {

/// The truth about a scene that is viewed by cameras. A surface point counts as seen if it is
/// unoccluded in some image and at least 3 pixels from its border.
class SpaceTruth {
 public:
  explicit SpaceTruth(ViewedScene viewed) : viewed_(std::move(viewed)) {}

  /// Distance to the nearest surface; empty if no image shows the nearest point.
  std::optional<double> distanceFrom(const Eigen::Vector3d& p_W) const;

  /// Whether any solid extends into a box.
  bool isTaken(const Eigen::AlignedBox3d& box_W) const;

  /// Whether some view looks through a whole box, to its far end and within `max_range_m`; tested
  /// on a grid of points that includes the corners.
  bool isSeenThrough(const Eigen::AlignedBox3d& box_W, double max_range_m) const;

 private:
  bool isSeen(const Eigen::Vector3d& p_W) const;
  bool isClear(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const;

  ViewedScene viewed_;
};

/// Errors in distances: the map's distance minus the true distance.
struct DistanceErrors {
  size_t count = 0;
  double rmse_m = 0.0, mean_m = 0.0, least_m = 0.0, greatest_m = 0.0;
  size_t far_off = 0;  ///< Off by more than kFarOff_cells.
};

struct SpaceFigures {
  double cell_m = 0.0;
  size_t free_cells = 0, surface_cells = 0;
  DistanceErrors at_middles;  ///< Errors at the centres of known cells.
  DistanceErrors at_points;   ///< Errors of distanceAt() at a random point of each known cell.
  size_t looked_at = 0;       ///< Free cells of the map that were checked.
  size_t taken = 0;           ///< Checked cells into which a solid extends.
  size_t unseen = 0;          ///< Checked cells that no view looks through completely.
  size_t truly_free = 0;      ///< Random cells without solids that some view looks through.
  size_t found_free = 0;      ///< Truly free cells that are free in the map.
};

struct SpaceQuestions {
  double max_distance_m;    ///< Distances are compared up to this value.
  double max_range_m;       ///< Range within which a view shows free space.
  size_t samples = 100000;  ///< Maximum number of cells for each figure.
};

/// Free cells are shrunk by this on all sides when they are compared with solids and views, to
/// allow for rounding.
constexpr double kBoxMargin_m = 1e-3;

/// No distance should be off by more than this.
constexpr double kFarOff_cells = 1.5;

/// Runs on all cores. @pre Distances are up to date.
SpaceFigures measureSpace(const Space& space, const SpaceTruth& truth,
                          const SpaceQuestions& questions);

std::string toJson(const SpaceFigures& figures);

}  // namespace dtsdf
