/// Maps of a room for tests that save, load and continue a map.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "dtsdf_mapping/map_contents.h"
#include "mapper/probed_mapper.h"
#include "support/colour_frames.h"
#include "support/depth_frames.h"

namespace dtsdf {

/// Depth and colour images of a room with a box that disappears. The images are rendered only once.
struct RoomRecording {
  std::vector<SceneFrame> depth;
  std::vector<PaintedFrame> colour;
};
const RoomRecording& roomRecording();

/// Colour pattern that changes every 0.1 m along each axis.
Colour stripes(const Eigen::Vector3d& p_W);

/// Fuses depth images `first` to `last` - 1 and, if `painted`, also the corresponding colour
/// images.
void feed(Mapper& mapper, size_t first, size_t last, bool painted);

/// Uses one thread, because several threads would wait for each other on a busy machine.
inline MapperParams roomParams(float voxel_size_m = 0.02f) {
  return makeCpuParams(FusionMode::kNormalRayCasting, true, voxel_size_m, 1);
}

/// Contents of a map of the whole recording.
MapContents roomContents(bool painted = true, const MapperParams& params = roomParams());

/// Extracts the whole mesh of a mapper whose mesh has never been extracted.
Mesh meshOf(Mapper& mapper, float voxel_size_m);

/// A copy of the contents. MapContents has no copy constructor, to prevent accidental copies.
MapContents copyOf(const MapContents& contents);

testing::AssertionResult sameContents(const MapContents& a, const MapContents& b);

}  // namespace dtsdf
