/// The stage "make surfels" on the CPU.
#pragma once

#include <vector>

#include "backend/rules.h"
#include "cpu/measured_span.h"
#include "cpu/stretch_fit.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "kernels/surfels/surfel.h"

namespace dtsdf {

class SurfelMaker {
 public:
  SurfelMaker(const MapperParams& params, const SurfelRules& rules, int threads);

  /// For casting, creates a surfel for each merged square, unmerged pixel or subpixel. All of these
  /// have a weight, and their order does not matter. For voxel projection, creates one per pixel,
  /// in row-major order, with weight 0 where there is no surfel.
  void makeSurfels(const FrameSensing& sensing);

  /// The surfels created by the last makeSurfels(); a single list for voxel projection.
  const std::vector<std::vector<Surfel>>& lists() const { return lists_; }

  size_t bytes() const;

 private:
  void makePixelSurfels(const FrameSensing& sensing);
  void makeRow(const FrameSensing& sensing, int v);
  void makeListOfSurfels(const FrameSensing& sensing);
  /// Appends the surfels of the patches whose first row is `first_v`; `patches` is a buffer.
  void makePatches(const FrameSensing& sensing, int first_v, std::vector<MergedPatch>& patches,
                   std::vector<Surfel>& surfels) const;
  void makeSingles(const FrameSensing& sensing, int v, const PixelSpan& span,
                   const std::vector<MergedPatch>& patches, std::vector<Surfel>& surfels) const;
  template <class Visit>
  void visitColumnFits(const FrameSensing& sensing, const Pixel& first, uint64_t wanted,
                       const Visit& visit) const;

  const bool merges_;  ///< Whether to merge and subdivide pixels.
  const SurfelSettings surfel_settings_;
  const int threads_;
  std::vector<std::vector<Surfel>> lists_;  ///< When casting, one per row of patches.
};

}  // namespace dtsdf
