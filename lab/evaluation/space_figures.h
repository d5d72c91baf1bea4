/// Figures that compare what a map knows of space with what is true of it.
#pragma once

#include <string>

#include "dtsdf_mapping/space.h"
#include "evaluation/space_truth.h"

namespace dtsdf {

/// Errors of distances: what was told less the distance to what was seen. Too little was told only
/// where it is less than the distance to any surface.
struct DistanceErrors {
  size_t count = 0;
  double rmse_m = 0.0, mean_m = 0.0;
  double least_m = 0.0;                 ///< Less than 0 where too little was told, of all surfaces.
  double greatest_m = 0.0;              ///< Where too much was told.
  size_t far_below = 0, far_above = 0;  ///< Off by more than kFarOff_cells.
  Eigen::Vector3d least_at_W = Eigen::Vector3d::Zero(), greatest_at_W = Eigen::Vector3d::Zero();
};

struct SpaceFigures {
  double cell_m = 0.0;
  size_t free_cells = 0, surface_cells = 0;
  DistanceErrors at_middles;  ///< From the middles of cells that are known.
  DistanceErrors at_points;   ///< From a point anywhere in each of them, by Space::distanceAt().
  // Of the cells that are called free, of which so many were looked at:
  size_t looked_at = 0;
  size_t taken = 0;   ///< Something solid, or a surface that was seen, reaches into it.
  size_t unseen = 0;  ///< No view looks through all of it.
  // Of cells in the bounds, chosen evenly, that nothing reaches into and a view looks through:
  size_t truly_free = 0;
  size_t found_free = 0;  ///< Called free.
};

struct SpaceQuestions {
  Views views;
  double max_distance_m;    ///< Distances are compared up to here.
  double max_range_m;       ///< How far a view sees what is free.
  size_t samples = 100000;  ///< Cells that are looked at for each figure, at most.
};

/// Boxes are shrunk by this on all sides before anything is looked for in them, since depth images
/// are rounded.
constexpr double kBoxMargin_m = 1e-3;

/// What a distance between cells should never be off by.
constexpr double kFarOff_cells = 1.5;

/// Asks for the figures on all cores. @pre Distances are up to date.
SpaceFigures measureSpace(const Space& space, const SpaceTruth& truth,
                          const SpaceQuestions& questions);

std::string toJson(const SpaceFigures& figures);

}  // namespace dtsdf
