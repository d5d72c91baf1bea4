/// The pixel of a rendered view, from where its ray meets the map.
#pragma once

#include "kernels/colour/vertex_colour.h"
#include "kernels/render/cast_ray.h"

namespace dtsdf {

/// The colours at the corners of a unit, of the directions whose surface faces the camera.
struct UnitColours {
  VertexColour corner[kCubeCorners];
};

/// `coloured(direction, corner)` gives a direction's ColouredSample.
template <class Coloured>
DTSDF_HD UnitColours coloursOf(const RayUnit& unit, const Coloured& coloured) {
  UnitColours colours;
  for (int c = 0; c < kCubeCorners; ++c) {
    ColourMean mean;
    for (int d = 0; d < kDirectionCount; ++d) {
      if (!(unit.directions >> d & 1)) continue;
      const ColouredSample sample = coloured(d, c);
      addTo(mean, sample.colour, sample.sample.weight);
    }
    colours.corner[c] = colourOf(mean);
  }
  return colours;
}

/// The colour at a place in a unit: between those of its painted corners. The farthest one counts a
/// little where it is the only one.
DTSDF_HD VertexColour colourIn(const UnitColours& colours, const Vec3f& at) {
  constexpr float kLeast = 1e-3f;
  ColourMean mean;
  for (int c = 0; c < kCubeCorners; ++c) {
    const VertexColour& colour = colours.corner[c];
    if (colour.painted == 0) continue;
    const float x = (c & 1) != 0 ? at.x : 1.0f - at.x, y = (c & 2) != 0 ? at.y : 1.0f - at.y;
    const float z = (c & 4) != 0 ? at.z : 1.0f - at.z;
    const float weight = maximum(x * y * z, kLeast);
    mean.red += weight * static_cast<float>(colour.red);
    mean.green += weight * static_cast<float>(colour.green);
    mean.blue += weight * static_cast<float>(colour.blue);
    mean.weight += weight;
  }
  return colourOf(mean);
}

/// A pixel of a view.
struct RenderedPixel {
  float depth;     ///< In voxels; 0: no surface.
  Vec3f normal_C;  ///< In the camera's frame.
  VertexColour colour;
};

DTSDF_HD RenderedPixel pixelWithoutSurface() { return {0.0f, {0.0f, 0.0f, 0.0f}, {0, 0, 0, 0}}; }

/// `units` as castRay() asks; `units.coloursAt(unit)` gives those of a unit that was found.
template <class Units>
DTSDF_HD RenderedPixel castPixel(const FrameView& frame, const Pixel& pixel, const TileRange& range,
                                 bool painted, Units& units) {
  if (!(range.near < range.far)) return pixelWithoutSurface();
  const RayHit hit = castRay(rayOf(frame, pixel), range, units);
  if (!(hit.depth > 0.0f)) return pixelWithoutSurface();
  return {hit.depth, rotateInverse(frame.T_L_C, hit.normal_L),
          painted ? colourIn(units.coloursAt(hit.unit), hit.at) : VertexColour{0, 0, 0, 0}};
}

}  // namespace dtsdf
