/// The points of a block that face the camera, and what an image says of them: sampleColour() from
/// there on, for several at once. Same bits.
#pragma once

#include <cstdint>
#include <vector>

#include "cpu/scratch_array.h"
#include "cpu/surface_points.h"
#include "kernels/colour/paint.h"

namespace dtsdf {

/// What the image says of one voxel of a block: direction times kVoxelsPerBlock + voxel.
struct VoxelSample {
  uint16_t voxel;
  ColourSample sample;
};

/// Those of a block.
class VoxelSamples {
 public:
  size_t count() const { return count_; }
  const VoxelSample* begin() const { return samples_.begin(); }
  const VoxelSample* end() const { return begin() + count_; }
  size_t bytes() const { return samples_.bytes(); }

 private:
  friend class FacingPoints;
  ScratchArray<VoxelSample> samples_;  ///< With room for one that is not taken.
  size_t count_ = 0;
};

class FacingPoints {
 public:
  void clear() { count_ = 0; }
  size_t count() const { return count_; }

  /// Adds those points of a direction that face the camera.
  void add(const SurfacePoints& points, int direction);

  /// Samples the image at those that nothing hides.
  void sample(const ColourSensing& sensing, VoxelSamples& samples) const;

  size_t bytes() const { return groups_.capacity() * sizeof(Group); }

 private:
  static constexpr int kGroup = 8;

  /// Of so many points.
  struct Group {
    float depth_m[kGroup], cosine[kGroup], u[kGroup], v[kGroup];
    float inverse_depth[kGroup], per_u[kGroup], per_v[kGroup];
    uint16_t voxel[kGroup];
  };

  std::vector<Group> groups_;
  size_t count_ = 0;  ///< Of points.
};

}  // namespace dtsdf
