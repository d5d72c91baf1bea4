/// Some of the points that a depth image shows, spread over it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// Depth in metres; 0 where nothing is measured. @pre The pixel lies in the image.
double depthAt(const DepthFrame& frame, int u, int v);

/// The points of so many rays, in the camera's frame; those without a measurement are left out.
std::vector<Eigen::Vector3d> thinnedPoints(const DepthFrame& frame, int columns, int rows);

/// Has a frame whose depth is along each pixel's ray have it along the optical axis, as floats in
/// `pixels`, which have room for the image and outlive the frame.
void turnToAxis(DepthFrame& frame, float* pixels);

}  // namespace dtsdf
