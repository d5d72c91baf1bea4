/// Noise of an active stereo camera that matches windows of pixels, as the RealSense D400 series.
///
/// The disparity is off by 0.08 pixels, what the maker recommends to reckon with, at a baseline of
/// 50 mm (Grunnet-Jepsen, Sweetser and Woodfill, "Tuning depth cameras for best performance", Intel
/// RealSense documentation: RMS = z^2 * subpixel / (focal length * baseline)), and told in steps of
/// 1/32 pixel (Grunnet-Jepsen, Sweetser, Khuong, Tong and Woodfill, "Subpixel linearity improvement
/// for Intel RealSense depth camera D400 series"). Neighbours err alike, as their windows of 7 x 7
/// pixels overlap (the R200 sums matching costs over that size: Keselman, Woodfill, Grunnet-Jepsen
/// and Bhowmik, "Intel RealSense stereoscopic depth cameras", CVPR workshops 2017; later cameras of
/// the maker smooth in other ways). What the second camera does not see is lost, as by a check of
/// left against right. How often a patch has too little texture is not published but chosen: about
/// 3 % of the image, in patches of some ten pixels; unlike real ones they do not stay on the
/// surface from frame to frame. Edges of things are where they are: their depth does not spread
/// beyond them by half a window, as it may with block matching.
#pragma once

#include <cstdint>
#include <vector>

#include "evaluation/camera_views.h"

namespace dtsdf {

/// Standard normal for each pixel, row-major: white noise averaged over window x window pixels, so
/// that pixels as far apart as the window is wide are independent.
std::vector<double> correlatedNormals(int width, int height, int window, uint64_t seed);

/// For each pixel of the left camera, whether the right one sees its point: it lies in its image,
/// and nothing nearer lies on the same ray. Pixels without depth count as seen.
std::vector<bool> seenByBoth(const std::vector<float>& depth_m, const ViewCamera& camera);

/// Adds the parts for stereo to what is measured so far; `true_m` is the depth without noise.
void addStereoNoise(const std::vector<float>& true_m, const ViewCamera& camera, uint64_t seed,
                    std::vector<float>& measured_m);

}  // namespace dtsdf
