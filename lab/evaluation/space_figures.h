/// Figures that compare what a map knows of space with what is true of it, in analytic scenes.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "dtsdf_mapping/space.h"
#include "evaluation/space_scenes.h"

namespace dtsdf {

/// The truth about a scene that cameras see. A surface counts as seen where its point lies inside
/// some image with nothing in front of it.
class SpaceTruth {
 public:
  explicit SpaceTruth(ViewedScene viewed) : viewed_(std::move(viewed)) {}

  /// To the nearest surface; none where no image shows the nearest point.
  std::optional<double> distanceFrom(const Eigen::Vector3d& p_W) const;

  /// Whether something solid reaches into a box.
  bool isTaken(const Eigen::AlignedBox3d& box_W) const;

  /// Whether some view sees through all of a box, to its far end and no farther than
  /// `max_range_m`, by a grid of points in it with the corners among them.
  bool isSeenThrough(const Eigen::AlignedBox3d& box_W, double max_range_m) const;

 private:
  bool isSeen(const Eigen::Vector3d& p_W) const;
  bool isClear(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const;

  ViewedScene viewed_;
};

/// Errors of distances: the map's less the true one.
struct DistanceErrors {
  size_t count = 0;
  double rmse_m = 0.0, mean_m = 0.0, least_m = 0.0, greatest_m = 0.0;
  size_t far_off = 0;  ///< Off by more than kFarOff_cells.
};

struct SpaceFigures {
  double cell_m = 0.0;
  size_t free_cells = 0, surface_cells = 0;
  DistanceErrors at_middles;  ///< From the middles of known cells.
  DistanceErrors at_points;   ///< From a point anywhere in each of them, by Space::distanceAt().
  size_t looked_at = 0;       ///< Cells that the map calls free and that were compared.
  size_t taken = 0;           ///< Those that something solid reaches into.
  size_t unseen = 0;          ///< Those that no view sees through as a whole.
  size_t truly_free = 0;      ///< Random cells that are free in truth, as a view shows.
  size_t found_free = 0;      ///< Those that the map calls free.
};

struct SpaceQuestions {
  double max_distance_m;    ///< Distances are compared up to here.
  double max_range_m;       ///< How far a view sees what is free.
  size_t samples = 100000;  ///< Cells for each figure, at most.
};

/// Boxes are shrunk by this on all sides, since depth images are rounded.
constexpr double kBoxMargin_m = 1e-3;

/// No distance should be off by more than this.
constexpr double kFarOff_cells = 1.5;

/// On all cores. @pre Distances are up to date.
SpaceFigures measureSpace(const Space& space, const SpaceTruth& truth,
                          const SpaceQuestions& questions);

std::string toJson(const SpaceFigures& figures);

}  // namespace dtsdf
