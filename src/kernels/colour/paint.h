/// Paints voxels from a colour image.
#pragma once

#include "kernels/colour/colour_image.h"
#include "kernels/colour/exposure.h"
#include "kernels/colour/hiding.h"
#include "kernels/core/voxel_colour.h"

namespace dtsdf {

/// A colour image with the data needed to paint from it.
struct ColourSensing {
  PointView view;
  ColourImage image;
  const float* hiding_m;  ///< See isHidden().
};

/// A voxel's colour in an image; the weight is 0 if there is none.
struct ColourSample {
  uint8_t red, green, blue;
  float weight;
};

DTSDF_HD uint8_t roundColour(float value) { return static_cast<uint8_t>(value + 0.5f); }

/// Weight of an image's view of a point, in (0, 1]: the product of factors for angle, distance and
/// sharpness (the foreshortened width of a voxel in pixels). The product is squared, since one view
/// that is twice as good is worth more than two views.
DTSDF_HD float viewWeight(const PointView& view, const SurfacePoint& point) {
  const float width_px = point.cosine * voxelWidth(view.frame, point);
  const float quality = point.cosine * minimum(1.0f, view.full_weight_depth_m / point.depth_m) *
                        minimum(1.0f, width_px);
  return quality * quality;
}

/// Side in pixels of the square over which a point's colour is averaged.
DTSDF_HD float sampleWidth(const PointView& view, const SurfacePoint& point) {
  return view.rules.sample_width * voxelWidth(view.frame, point);
}

DTSDF_HD ColourSample sampleAt(const ColourSensing& sensing, const SurfacePoint& point) {
  const PointView& view = sensing.view;
  const Rgb colour =
      colourAt(sensing.image, levelOfWidth(sampleWidth(view, point)), point.u, point.v);
  return {roundColour(colour.red), roundColour(colour.green), roundColour(colour.blue),
          viewWeight(view, point)};
}

/// The image's sample for the voxel at `index` in its array; the weight is 0 if the voxel is not
/// visible.
DTSDF_HD ColourSample sampleColour(const ColourSensing& sensing, const Vec3f& first_voxel_L,
                                   const Voxel* voxels, int index, int direction) {
  const ColourSample nothing{0, 0, 0, 0.0f};
  const PointView& view = sensing.view;
  SurfacePoint point;
  if (!isNearSurface(view, voxels[index]) ||
      !findSurfacePoint(view, first_voxel_L, voxels, index, direction, point) ||
      !(point.cosine > 0.0f)) {
    return nothing;
  }
  return isHidden(view, sensing.hiding_m, point) ? nothing : sampleAt(sensing, point);
}

/// The weighted mean of a voxel's colour and a sample. See ColourRules::max_views for the resulting
/// weight.
DTSDF_HD VoxelColour paintedColour(const VoxelColour& colour, const ColourSample& sample,
                                   const Exposure& exposure, const ColourRules& rules) {
  const float before = colourWeight(colour.weight), total = before + sample.weight;
  const float share = sample.weight / total;
  const float most = static_cast<float>(rules.max_views) * sample.weight;
  return {roundColour(between(colour.red, exposed(sample.red, exposure.gain[0]), share)),
          roundColour(between(colour.green, exposed(sample.green, exposure.gain[1]), share)),
          roundColour(between(colour.blue, exposed(sample.blue, exposure.gain[2]), share)),
          colourWeightCode(maximum(before, minimum(total, most)))};
}

}  // namespace dtsdf
