/// The exposure of an image against that of the map: the same surface is to have one colour,
/// however long the camera's shutter was open.
///
/// One gain per channel, the ratio of what the map shows to what the image shows of the same
/// voxels. A longer exposure multiplies encoded values too, by a power of itself, so that a gain is
/// right for them as well.
#pragma once

#include "kernels/colour/colour_rules.h"
#include "kernels/core/voxel_colour.h"

namespace dtsdf {

/// What an image is to be multiplied by: red, green, blue.
struct Exposure {
  float gain[3];
};

DTSDF_HD Exposure sameExposure() { return {{1.0f, 1.0f, 1.0f}}; }

/// Sums over the voxels that both show. A channel adds 255 at most, so that those of 2^55 voxels
/// fit, more than any map has.
struct ExposureSums {
  int64_t map[3], image[3];
  int64_t voxels;
};

/// Whether a channel is not cut off.
DTSDF_HD bool isWellExposed(uint8_t value) { return value > 0 && value < 255; }
DTSDF_HD bool isWellExposed(const VoxelColour& colour) {
  return isWellExposed(colour.red) && isWellExposed(colour.green) && isWellExposed(colour.blue);
}

/// Whether a voxel tells of the exposure: both have seen it about as well. What is at an outline,
/// or seen much better than before, may differ for other reasons.
DTSDF_HD bool tellsExposure(const VoxelColour& map, const VoxelColour& image, float image_weight,
                            const ColourRules& rules) {
  const float views = static_cast<float>(rules.most_views) * image_weight;
  const float before = colourWeight(map.weight);
  return before > 0.0f && views >= 0.5f * before && image_weight <= 2.0f * before &&
         isWellExposed(map) && isWellExposed(image);
}

DTSDF_HD void addToSums(ExposureSums& sums, const VoxelColour& map, const VoxelColour& image) {
  sums.map[0] += map.red;
  sums.map[1] += map.green;
  sums.map[2] += map.blue;
  sums.image[0] += image.red;
  sums.image[1] += image.green;
  sums.image[2] += image.blue;
  ++sums.voxels;
}

/// The gains for an image; those of the one before where too little of the map is seen again. Gains
/// that are about 1 are 1: else small errors would add up from image to image. Where exposures are
/// fixed, all are 1, whatever the map shows.
DTSDF_HD Exposure exposureOf(const ExposureSums& sums, const Exposure& before,
                             const PaintSettings& settings) {
  const ColourRules& rules = settings.rules;
  if (settings.fixed_exposure) return sameExposure();
  if (sums.voxels < rules.least_overlap) return before;
  Exposure exposure;
  bool same = true;
  for (int i = 0; i < 3; ++i) {
    const float gain = static_cast<float>(sums.map[i]) / static_cast<float>(sums.image[i]);
    exposure.gain[i] = gain;
    same = same && fabsf(gain - 1.0f) <= rules.same_gain;
  }
  return same ? sameExposure() : exposure;
}

/// A channel as the map would have it.
DTSDF_HD float exposed(uint8_t value, float gain) {
  return minimum(static_cast<float>(value) * gain, 255.0f);
}

}  // namespace dtsdf
