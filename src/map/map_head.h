/// What a map's contents tell besides blocks, voxels and colours.
#pragma once

#include "dtsdf_mapping/map_contents.h"

namespace dtsdf {

/// A copy of the contents without blocks, voxels and colours.
inline MapContents headOf(const MapContents& contents) {
  MapContents head;
  head.settings = contents.settings;
  head.map_frame = contents.map_frame;
  head.stamp_s = contents.stamp_s;
  head.frames = contents.frames;
  head.supporting_frames = contents.supporting_frames;
  head.painted = contents.painted;
  head.exposure = contents.exposure;
  return head;
}

}  // namespace dtsdf
