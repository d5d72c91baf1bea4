/// Maps of a room that are saved, loaded and gone on with.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "mapper/probed_mapper.h"
#include "support/colour_frames.h"
#include "support/depth_frames.h"

namespace dtsdf {

/// Depth and colour images of a room in which a box stands for a while; rendered once.
struct RoomRecording {
  std::vector<SceneFrame> depth;
  std::vector<PaintedFrame> colour;
};
const RoomRecording& roomRecording();

/// The colour of a surface, by its place.
Colour stripes(const Eigen::Vector3d& p_W);

/// Fuses frames `first` to `last` - 1, painted where that is wanted.
void feed(Mapper& mapper, size_t first, size_t last, bool painted);

/// One thread, where threads do not matter: on a busy machine several wait for each other.
inline MapperParams roomParams(float voxel_size_m = 0.02f) {
  return makeCpuParams(FusionMode::kNormalRayCasting, true, voxel_size_m, 1);
}

/// The map of the whole recording.
MapContents roomContents(bool painted = true, const MapperParams& params = roomParams());

/// The whole mesh, made anew.
Mesh meshOf(Mapper& mapper, float voxel_size_m);

/// A copy, which contents themselves cannot be made to give by chance.
MapContents copyOf(const MapContents& contents);

testing::AssertionResult sameContents(const MapContents& a, const MapContents& b);

}  // namespace dtsdf
