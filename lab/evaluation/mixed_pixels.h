/// Mixed (flying) pixels of a time-of-flight camera: at a depth edge, a pixel receives light from
/// both surfaces and returns a depth between them.
///
/// For depths well within the unambiguous range, the phase of the summed signal yields the mean of
/// the two depths, weighted by amplitude. The amplitude falls with the square of the distance
/// (Sarbolandi, Lefloch and Kolb, "Kinect range sensing: structured-light versus time-of-flight
/// Kinect", CVIU 2015, on inhomogeneous depth; for a newer sensor, see Toelgyessy et al.,
/// "Evaluation of the Azure Kinect and its comparison to Kinect V1 and Kinect V2", Sensors 2021).
/// The fraction of a pixel beyond the edge is drawn from a uniform distribution, since it cannot be
/// derived from a rendered image.
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/camera_views.h"

namespace dtsdf {

/// Mean of the depths of two surfaces, weighted by amplitude. `other_share` is the fraction of the
/// pixel covered by the second surface.
float mixDepths(float own_m, float other_m, float other_share);

/// Returns the depth image with mixed pixels. At an edge, up to half of a pixel is covered by the
/// surface of its neighbour (one of four) whose depth differs most. Pixels without a surface
/// are not mixed, since no light returns from them.
std::vector<float> mixPixels(const std::vector<float>& depth_m, const ViewCamera& camera,
                             uint64_t seed);

}  // namespace dtsdf
