/// Noise models for rendered depth images, for three kinds of depth camera.
///
/// `kinect`, the first Kinect: axial and lateral noise after Nguyen, Izadi and Lovell, "Modeling
/// Kinect sensor noise for improved 3D reconstruction and tracking", 3DIMPVT 2012, Sec. 3;
/// disparity quantisation after Khoshelham and Oude Elberink, "Accuracy and resolution of Kinect
/// depth data for indoor mapping applications", Sensors 2012. Pixels are lost at random on surfaces
/// at grazing angles and next to depth edges. Unlike the noise of a real Kinect, this noise is not
/// correlated between neighbouring pixels.
///
/// `tof`, a time-of-flight camera: axial noise of the second Kinect after Fankhauser, Bloesch,
/// Rodriguez, Kaestner, Hutter and Siegwart, "Kinect v2 for mobile robot navigation: evaluation and
/// modeling", ICAR 2015, and mixed pixels (mixed_pixels.h).
///
/// `stereo`, an active stereo camera: correlated and quantised disparity noise, loss of pixels that
/// lack texture or are visible to only one of the two cameras (stereo_noise.h), and random loss as
/// for `kinect`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "evaluation/depth_renderer.h"

namespace dtsdf {

enum class DepthNoise { kNone, kKinect, kTof, kStereo };

/// The model named none, kinect, tof or stereo. @throws std::invalid_argument for other names.
DepthNoise depthNoiseFromName(const std::string& name);

/// Standard deviation of the first Kinect along the optical axis in metres, for a surface whose
/// normal is `angle_rad` away from the view ray.
double axialSigma(double z_m, double angle_rad);

/// Standard deviation of the first Kinect across the optical axis in pixels.
double lateralSigma(double angle_rad);

/// Standard deviation of a time-of-flight camera along the optical axis in metres. It grows with
/// the angle and, beyond 0.83 m, with distance.
double tofAxialSigma(double z_m, double angle_rad);

/// The depth that the sensor would measure in a view. The same seed gives the same noise.
std::vector<float> addNoise(const DepthView& view, const ViewCamera& camera, DepthNoise noise,
                            uint64_t seed);

}  // namespace dtsdf
