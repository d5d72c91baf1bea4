/// Computes the links (kernels/surfels/links.h) of all pixels in an image.
#pragma once

#include <vector>

#include "kernels/surfels/links.h"

namespace dtsdf {

inline std::vector<PixelLinks> linksOfImage(const FrameView& frame,
                                            const std::vector<float>& inverse_depth,
                                            const DepthNoise& noise,
                                            const SurfelSettings& surfels) {
  const LinkLimits limits = linkLimits(frame, noise, surfels);
  std::vector<PixelLinks> links;
  for (int v = 0; v < frame.height; ++v) {
    for (int u = 0; u < frame.width; ++u) {
      links.push_back(linksOf(frame, inverse_depth.data(), {u, v}, limits));
    }
  }
  return links;
}

}  // namespace dtsdf
