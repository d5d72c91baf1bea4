/// Noise of an active stereo camera that matches windows of pixels, like the RealSense D400 series.
///
/// The disparity error has a standard deviation of 0.08 pixels, the value that the manufacturer
/// recommends, for a baseline of 50 mm (Grunnet-Jepsen, Sweetser and Woodfill, "Tuning depth
/// cameras for best performance", Intel RealSense documentation: RMS = z^2 * subpixel / (focal
/// length * baseline)). Disparities are rounded to 1/32 pixel (Grunnet-Jepsen, Sweetser, Khuong,
/// Tong and Woodfill, "Subpixel linearity improvement for Intel RealSense depth camera D400
/// series"). Errors of neighbours are correlated, since their windows of 7 x 7 pixels overlap (the
/// R200 sums matching costs over that size: Keselman, Woodfill, Grunnet-Jepsen and Bhowmik, "Intel
/// RealSense stereoscopic depth cameras", CVPR workshops 2017; later cameras of the manufacturer
/// use other smoothing). Pixels that the second camera does not see are lost, as after a left-right
/// check. The share of the image with too little texture is not published; it is set to about 3 %,
/// in patches of some ten pixels. Unlike the patches of a real camera, these patches do not stay on
/// the surface from frame to frame. Objects keep their outlines: depth does not spread beyond them
/// by half a window, as it may with block matching.
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/camera_views.h"

namespace dtsdf {

/// Standard normal values for each pixel, row-major: white noise averaged over window x window
/// pixels, so that pixels at least `window` apart are independent.
std::vector<double> correlatedNormals(int width, int height, int window, uint64_t seed);

/// For each pixel of the left camera, whether the right camera sees its point: the point lies in
/// the right image, with nothing nearer on its ray. To the left of a narrow object in the
/// foreground, more pixels than that count as not seen. Pixels without depth count as seen.
std::vector<bool> seenByBoth(const std::vector<float>& depth_m, const ViewCamera& camera);

/// Adds the effects of stereo to `measured_m`; `true_m` is the depth without noise.
void addStereoNoise(const std::vector<float>& true_m, const ViewCamera& camera, uint64_t seed,
                    std::vector<float>& measured_m);

}  // namespace dtsdf
