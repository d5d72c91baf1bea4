/// Mixed (flying) pixels of a time-of-flight camera: at a depth edge, a pixel receives light from
/// both surfaces and returns a depth between them.
///
/// The phase of the sum of both signals gives, for depths well within the unambiguous range, the
/// mean of the two depths weighted by amplitude, which falls with the square of the distance
/// (Sarbolandi, Lefloch and Kolb, "Kinect range sensing: structured-light versus time-of-flight
/// Kinect", CVIU 2015, on inhomogeneous depth; Toelgyessy et al., "Evaluation of the Azure Kinect
/// and its comparison to Kinect V1 and Kinect V2", Sensors 2021, show the pixels of a newer
/// sensor). The share of a pixel that lies beyond the edge is drawn uniformly, since it cannot be
/// known from a rendered image.
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/camera_views.h"

namespace dtsdf {

/// Mean of the depths of two surfaces, weighted by the amplitudes that they reflect, if
/// `other_share` of the pixel's area shows the second surface.
float mixDepths(float own_m, float other_m, float other_share);

/// The depth image with mixed pixels: up to half of each pixel at an edge shows the surface of the
/// neighbour, out of four, whose depth differs most. Pixels without a surface are not mixed with
/// others, since they return no light.
std::vector<float> mixPixels(const std::vector<float>& depth_m, const ViewCamera& camera,
                             uint64_t seed);

}  // namespace dtsdf
