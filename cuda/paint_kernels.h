/// The stage "paint" on the device: what its kernels read and write, and their launches.
#pragma once

#include "device_map.h"
#include "kernels/colour/paint.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

/// What the host has to know of an image's look at the map.
struct LookCounters {
  uint32_t blocks;    ///< In view.
  uint32_t seen;      ///< Of these, blocks that something is to be painted in.
  uint32_t requests;  ///< Of these, blocks that lack bricks of colours for it.
  uint32_t unused;    ///< In place of padding.
  ExposureSums sums;
  uint64_t samples;   ///< Voxels that the image was found to show.
};

/// What kernels need of a look, by value.
struct LookView {
  LookCounters* counters;
  int32_t* slots;  ///< Of the blocks in view.
  ColourRequest* requests;
  int thread_blocks;  ///< That fill the device, since what there is to do is known there only.
};

// Each enqueues one step.

/// The levels of an image below the first one.
void halveImage(const ColourImage& image, ColourPixel* pixels, const Stream& stream);

/// Lists the blocks in view.
void findBlocksInView(const PointView& view, const MapView& map, const LookView& look,
                      const Stream& stream);

/// Draws the surfaces in view into a depth image, `depth_m`, which is that of the sensing.
void drawHiding(const ColourSensing& sensing, const MapView& map, const LookView& look,
                float* depth_m, const Stream& stream);

/// Finds what the image shows of them.
void lookAtSurfaces(const ColourSensing& sensing, const MapView& map, const LookView& look,
                    const Stream& stream);

/// Paints what it shows, where there are bricks of colours.
void paintSurfaces(const ColourSensing& sensing, const Exposure& exposure, const MapView& map,
                   const LookView& look, const Stream& stream);

}  // namespace gpu
}  // namespace dtsdf
