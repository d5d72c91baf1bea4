/// Finds which pixels are fused as several surfels.
///
/// Far away or at a grazing angle, a pixel covers more of the surface than a voxel does. A single
/// surfel at its centre would leave voxels between neighbouring pixels without samples and so cause
/// holes. Such a pixel is subdivided into thirds along one or both axes of the image. The subpixels
/// lie on its plane.
#pragma once

#include "kernels/surfels/plane_fit.h"

namespace dtsdf {

/// Number of subpixels along the rows and columns of the image: 1 or kThirds.
struct Subdivision {
  int32_t across, down;
  /// Half a subpixel's width and height along axes where the pixel is over half a voxel wide and
  /// its neighbours continue its plane; otherwise 0.
  float half_across_px = 0.0f, half_down_px = 0.0f;
};

/// A surfel updates the samples on both of its sides, so with thirds, pixels up to five voxels wide
/// skip no samples.
constexpr int kThirds = 3;

DTSDF_HD int subpixelCount(const Subdivision& subdivision) {
  return subdivision.across * subdivision.down;
}

/// Whether a neighbour continues a pixel's surface: it must be linked (`link` is the bit for this
/// axis), and predicted by the pixel's plane, which rises by `step` in inverse depth towards it.
DTSDF_HD bool continuesPlane(const FrameSensing& sensing, const Pixel& pixel,
                             const Pixel& neighbour, PixelLinks link, float step,
                             const SurfelSettings& surfels) {
  const ImageView& image = sensing.image;
  const FrameView& frame = image.frame;
  if (neighbour.u < 0 || neighbour.v < 0 || neighbour.u >= frame.width ||
      neighbour.v >= frame.height) {
    return false;
  }
  const int64_t here = pixelIndex(frame, pixel), there = pixelIndex(frame, neighbour);
  return (image.links[here < there ? here : there] & link) != 0 &&
         isPredicted(image.inverse_depth[here], image.inverse_depth[there], step,
                     linkLimits(frame, sensing.noise, surfels));
}

/// How a measured pixel with a plane is subdivided: along axes where it is wider than a voxel and
/// both neighbours continue its surface. The half width along an axis is set for all pixels over
/// half a voxel wide, even undivided ones: with points only at pixel centres, the mesh would have
/// gaps, for instance between pixels 0.6 voxels apart.
DTSDF_HD Subdivision subdividePixel(const FrameSensing& sensing, const Pixel& pixel,
                                    const PixelPlane& plane, const SurfelSettings& surfels) {
  const ImageView& image = sensing.image;
  const FrameView& frame = image.frame;
  const auto& [u, v] = pixel;
  const float depth_m = 1.0f / image.inverse_depth[pixelIndex(frame, pixel)];
  const Vec3f p_C =
      backProject(frame.intrinsics, static_cast<float>(u), static_cast<float>(v), depth_m);
  // Step on the plane from one pixel to the next.
  Vec3f across = (-(plane.slope_u * depth_m)) * p_C, down = (-(plane.slope_v * depth_m)) * p_C;
  across.x += depth_m / frame.intrinsics.fx;
  down.y += depth_m / frame.intrinsics.fy;
  const auto isWiderThan = [&](const Vec3f& step_m, float voxels) {
    const float width_m = voxels * frame.voxel_size_m;
    return dot(step_m, step_m) > width_m * width_m;
  };
  Subdivision subdivision{1, 1};
  if (isWiderThan(across, 0.5f) &&
      continuesPlane(sensing, pixel, {u - 1, v}, kLinkRight, -plane.slope_u, surfels) &&
      continuesPlane(sensing, pixel, {u + 1, v}, kLinkRight, plane.slope_u, surfels)) {
    subdivision.across = isWiderThan(across, 1.0f) ? kThirds : 1;
    subdivision.half_across_px = 0.5f / static_cast<float>(subdivision.across);
  }
  if (isWiderThan(down, 0.5f) &&
      continuesPlane(sensing, pixel, {u, v - 1}, kLinkDown, -plane.slope_v, surfels) &&
      continuesPlane(sensing, pixel, {u, v + 1}, kLinkDown, plane.slope_v, surfels)) {
    subdivision.down = isWiderThan(down, 1.0f) ? kThirds : 1;
    subdivision.half_down_px = 0.5f / static_cast<float>(subdivision.down);
  }
  return subdivision;
}

/// Offset along an axis from a pixel's centre to that of subpixel `subpixel` out of `count`, in
/// pixels; less than half a pixel.
DTSDF_HD float subpixelOffset(int subpixel, int count) {
  return static_cast<float>(subpixel - count / 2) / static_cast<float>(count);
}

/// Inverse depth of a pixel's plane at an offset (du, dv) in pixels, but no farther away than the
/// pixel or its neighbours on those sides, whichever is farthest. The neighbours must be measured.
DTSDF_HD float inverseDepthBeside(const ImageView& image, const Pixel& pixel,
                                  const PixelPlane& plane, float du, float dv) {
  const int width = image.frame.width;
  const float* at = image.inverse_depth + pixelIndex(image.frame, pixel);
  float least = *at;
  if (du != 0.0f) least = minimum(least, at[du < 0.0f ? -1 : 1]);
  if (dv != 0.0f) least = minimum(least, at[dv < 0.0f ? -width : width]);
  return maximum(*at + du * plane.slope_u + dv * plane.slope_v, least);
}

}  // namespace dtsdf
