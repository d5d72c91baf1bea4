/// A slice through what a map knows of space, as a picture.
#pragma once

#include <string>
#include <vector>

#include "dtsdf_mapping/space.h"
#include "evaluation/space_truth.h"

namespace dtsdf {

struct SliceOptions {
  Eigen::AlignedBox3d bounds_W;  ///< x and y are drawn, at the middle of z.
  double pixel_m = 0.02;
  double full_scale_m = 2.0;            ///< Distance of the last colour.
  std::vector<Eigen::Vector3d> path_W;  ///< Drawn as a line; may be empty.
};

/// Free cells are coloured by distance, those with a surface are dark, unknown ones grey; the true
/// surfaces are drawn in, in black. @throws std::runtime_error if it cannot be written.
void writeSlice(const std::string& path, const Space& space, const SpaceTruth& truth,
                const SliceOptions& options);

}  // namespace dtsdf
