/// A noise model of the first Kinect for rendered depth images.
///
/// Axial and lateral noise after Nguyen, Izadi and Lovell, "Modeling Kinect sensor noise for
/// improved 3D reconstruction and tracking", 3DIMPVT 2012, Sec. 3; quantisation of the disparity
/// after Khoshelham and Oude Elberink, "Accuracy and resolution of Kinect depth data for indoor
/// mapping applications", Sensors 2012. Pixels are lost at random where the surface is seen flat
/// and beside depth edges. Real noise is also correlated between neighbours; this one is not.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "evaluation/depth_renderer.h"

namespace dtsdf {

struct DepthNoise {
  bool axial = false;         ///< Gaussian along the optical axis, growing with z^2 and slant.
  bool lateral = false;       ///< Each pixel looks up its depth a Gaussian step to the side.
  bool quantisation = false;  ///< Disparity in steps of 1/8 pixel at a baseline of 75 mm.
  bool loss = false;          ///< No measurement at flat angles and beside depth edges.

  bool any() const { return axial || lateral || quantisation || loss; }
};

/// "none", "kinect" (all four), or a list of axial, lateral, quantisation and loss with commas.
/// @throws std::invalid_argument for an unknown name.
DepthNoise depthNoiseFromName(const std::string& names);

/// Standard deviation along the optical axis in metres, for a surface whose normal is `angle_rad`
/// away from the view ray.
double axialSigma(double z_m, double angle_rad);

/// Standard deviation across the optical axis in pixels.
double lateralSigma(double angle_rad);

/// The depth that the sensor would give for a view; the same seed gives the same noise.
std::vector<float> addNoise(const RenderedView& view, const ViewCamera& camera,
                            const DepthNoise& noise, uint64_t seed);

}  // namespace dtsdf
