/// Computes 3D points from a depth image.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"

namespace dtsdf {

/// Depth of a pixel in metres; 0 if nothing was measured. @pre The pixel lies in the image.
double depthAt(const DepthFrame& frame, int u, int v);

/// Points, in the camera's frame, of a grid of columns x rows pixels; pixels without a measurement
/// are skipped.
std::vector<Eigen::Vector3d> thinnedPoints(const DepthFrame& frame, int columns, int rows);

/// Converts depth that was measured along each pixel's ray to depth along the optical axis. The
/// frame then refers to `pixels`, which must have room for the image and outlive the frame.
void rayToAxialDepth(DepthFrame& frame, float* pixels);

}  // namespace dtsdf
