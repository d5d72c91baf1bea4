/// Noise of an active stereo camera that matches pixel windows, like the RealSense D400 series.
///
/// The baseline is 50 mm. The disparity error has a standard deviation of 0.08 pixels, as
/// recommended by the manufacturer (Grunnet-Jepsen, Sweetser and Woodfill, "Tuning depth cameras
/// for best performance", Intel RealSense documentation: RMS = z^2 * subpixel / (focal length *
/// baseline)). Disparities are rounded to 1/32 pixel (Grunnet-Jepsen, Sweetser, Khuong, Tong and
/// Woodfill, "Subpixel linearity improvement for Intel RealSense depth camera D400 series"). Errors
/// in neighbouring pixels are correlated, since their 7 x 7 pixel windows overlap (the R200 sums
/// matching costs over windows of this size: Keselman, Woodfill, Grunnet-Jepsen and Bhowmik, "Intel
/// RealSense stereoscopic depth cameras", CVPR workshops 2017; newer RealSense cameras smooth
/// differently). Pixels that are not visible to the second camera are lost, as after a left-right
/// check. The fraction of pixels lost for lack of texture is not published; it is set to about 3 %,
/// in patches of about ten pixels. Unlike with a real camera, these patches do not stay on the
/// surface from frame to frame. Objects keep their outlines: depth does not extend beyond them by
/// half a window, as it may with block matching.
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/camera_views.h"

namespace dtsdf {

/// One standard normal value per pixel, row-major: white noise, summed over window x window pixels
/// and normalised, so that pixels at least `window` apart are independent.
std::vector<double> correlatedNormals(int width, int height, int window, uint64_t seed);

/// For each pixel of the left camera, whether its point is visible to the right camera, i.e.
/// projects into the right image and is not occluded. To the left of a narrow object in the
/// foreground, some visible pixels count as occluded too. Pixels without depth count as visible.
std::vector<bool> seenByBoth(const std::vector<float>& depth_m, const ViewCamera& camera);

/// Applies the stereo model to `measured_m`. `true_m` is the depth without noise.
void addStereoNoise(const std::vector<float>& true_m, const ViewCamera& camera, uint64_t seed,
                    std::vector<float>& measured_m);

}  // namespace dtsdf
