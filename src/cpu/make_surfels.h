/// The stage "make surfels" on the CPU: from what is known of a frame to its surfels.
#pragma once

#include <vector>

#include "backend/rules.h"
#include "cpu/measured_span.h"
#include "cpu/stretch_fit.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "kernels/surfels/surfel.h"

namespace dtsdf {

/// The buffers are kept from frame to frame.
class SurfelMaker {
 public:
  SurfelMaker(const MapperParams& params, const SurfelRules& rules, int threads);

  /// To be cast: a surfel per square of merged pixels, per pixel, or per subpixel, all with a
  /// weight, in no order that matters. For voxel projection: one per pixel in the image's order,
  /// with weight 0 where there is none.
  void makeSurfels(const FrameSensing& sensing);

  /// Those that were made last, in lists one after the other. For voxel projection there is one.
  const std::vector<std::vector<Surfel>>& lists() const { return lists_; }

  size_t bytes() const;

 private:
  void makePixelSurfels(const FrameSensing& sensing);
  void makeRow(const FrameSensing& sensing, int v);
  void makeListOfSurfels(const FrameSensing& sensing);
  /// Appends the surfels of the patches whose first row is `first_v`; `patches` is scratch.
  void makePatches(const FrameSensing& sensing, int first_v, std::vector<MergedPatch>& patches,
                   std::vector<Surfel>& surfels) const;
  void makeSingles(const FrameSensing& sensing, int v, const PixelSpan& span,
                   const std::vector<MergedPatch>& patches, std::vector<Surfel>& surfels) const;
  template <class Visit>
  void visitColumnFits(const FrameSensing& sensing, const Pixel& first, uint64_t wanted,
                       const Visit& visit) const;

  const bool merges_;  ///< Merges and subdivides pixels, as surfels are cast.
  const SurfelSettings surfel_settings_;
  const int threads_;
  std::vector<std::vector<Surfel>> lists_;  ///< One per row of patches if surfels are cast.
};

}  // namespace dtsdf
