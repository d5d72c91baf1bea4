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

/// Sums over the voxels that both show, by channel: of their values, squares and products. A voxel
/// adds 255^2 at most, so that those of 2^47 voxels fit, more than any map has.
struct ExposureSums {
  int64_t map[3], image[3];
  int64_t map_squares[3], image_squares[3], products[3];
  int64_t voxels;
};

/// Calls visit(sum, part) for each sum of the one and the same of the other.
template <class Visit>
DTSDF_HD void visitSums(ExposureSums& sums, const ExposureSums& parts, Visit&& visit) {
  for (int i = 0; i < 3; ++i) {
    visit(sums.map[i], parts.map[i]);
    visit(sums.image[i], parts.image[i]);
    visit(sums.map_squares[i], parts.map_squares[i]);
    visit(sums.image_squares[i], parts.image_squares[i]);
    visit(sums.products[i], parts.products[i]);
  }
  visit(sums.voxels, parts.voxels);
}

/// Whether a channel is not cut off.
DTSDF_HD bool isWellExposed(uint8_t value) { return value > 0 && value < 255; }
DTSDF_HD bool isWellExposed(const VoxelColour& colour) {
  return isWellExposed(colour.red) && isWellExposed(colour.green) && isWellExposed(colour.blue);
}

/// Whether a voxel tells of the exposure: both have seen it about as well. What is seen
/// much better or worse than before may differ for other reasons.
DTSDF_HD bool tellsExposure(const VoxelColour& map, const VoxelColour& image, float image_weight,
                            const ColourRules& rules) {
  const float views = static_cast<float>(rules.most_views) * image_weight;
  const float before = colourWeight(map.weight);
  return before > 0.0f && views >= 0.5f * before && image_weight <= 2.0f * before &&
         isWellExposed(map) && isWellExposed(image);
}

DTSDF_HD void addToSums(ExposureSums& sums, const VoxelColour& map, const VoxelColour& image) {
  const int32_t of_map[3] = {map.red, map.green, map.blue};
  const int32_t of_image[3] = {image.red, image.green, image.blue};
  for (int i = 0; i < 3; ++i) {
    sums.map[i] += of_map[i];
    sums.image[i] += of_image[i];
    sums.map_squares[i] += of_map[i] * of_map[i];
    sums.image_squares[i] += of_image[i] * of_image[i];
    sums.products[i] += of_map[i] * of_image[i];
  }
  ++sums.voxels;
}

/// The gain of a channel: the ratio of its values, drawn towards 1 as far as these differ for other
/// reasons. Of the squared difference between map and image, the ratio explains a part, as another
/// exposure changes all voxels alike. The rest is of other angles, places and lights: they leave a
/// bias in the ratio, too, which would add up from image to image. (cabinet, 58 images of one
/// exposure, 20 mm: red comes out 1.18 times too bright with the whole ratio, 1.01 times like this;
/// with a factor of 1 in place of the 2, 1.03. Images darkened by up to 40 % by turns: 0.97.)
DTSDF_HD float gainOf(const ExposureSums& sums, int channel) {
  const auto map = static_cast<double>(sums.map_squares[channel]);
  const auto image = static_cast<double>(sums.image_squares[channel]);
  const auto product = static_cast<double>(sums.products[channel]);
  const double ratio =
      static_cast<double>(sums.map[channel]) / static_cast<double>(sums.image[channel]);
  const double left = map - 2.0 * ratio * product + ratio * ratio * image;
  const double unexplained = left > 0.0 ? left : 0.0;
  const double explained = map - 2.0 * product + image - unexplained;
  if (!(explained > 0.0)) return 1.0f;
  const double share =
      explained * explained / (explained * explained + 2.0 * unexplained * unexplained);
  return static_cast<float>(1.0 + share * (ratio - 1.0));
}

/// The gains for an image; those of the one before where too little of the map is seen again. Where
/// exposures are fixed, all are 1, whatever the map shows.
DTSDF_HD Exposure exposureOf(const ExposureSums& sums, const Exposure& before,
                             const PaintSettings& settings) {
  if (settings.fixed_exposure) return sameExposure();
  if (sums.voxels < settings.rules.least_overlap) return before;
  return {{gainOf(sums, 0), gainOf(sums, 1), gainOf(sums, 2)}};
}

/// A channel as the map would have it.
DTSDF_HD float exposed(uint8_t value, float gain) {
  return minimum(static_cast<float>(value) * gain, 255.0f);
}

}  // namespace dtsdf
