/// The stage "paint" on the device: what its kernels read and write, and their launches.
#pragma once

#include "device_map.h"
#include "kernels/colour/paint.h"
#include "runtime/stream.h"

namespace dtsdf {
namespace gpu {

/// What the host has to know of an image's look at the map.
struct LookCounters {
  uint32_t blocks, arrays;  ///< In view: blocks, and their voxel arrays.
  uint32_t seen;            ///< Arrays of these that something is to be painted in.
  uint32_t requests;        ///< Of these, arrays that lack bricks of colours for it.
  ExposureSums sums;
  uint64_t samples;  ///< Voxels that the image was found to show, also those without room.
};

/// What an image shows of a voxel, until there are bricks of colours to paint it in.
struct FoundSample {
  int32_t slot;    ///< Of its block.
  uint16_t voxel;  ///< kVoxelsPerBlock * direction + index.
  ColourSample sample;
};

/// What kernels need of a look, by value.
struct LookView {
  LookCounters* counters;
  FoundSample* samples;  ///< Room for so many; of those beyond only the number is told.
  uint64_t most_samples;
  const int32_t* candidates;  ///< Slots of blocks that may be in view, and others.
  uint32_t candidate_count;
  int32_t* arrays;  ///< The voxel arrays in view: kDirectionCount * slot + direction.
  ColourRequest* requests;
  int thread_blocks;    ///< That fill the device, since what there is to do is known there only.
  BlockExtent painted;  ///< Blocks elsewhere only hide what is behind them.
};

// Each enqueues one step.

/// The pixels of an image from the bytes it came in, rows packed.
void takePixels(const uint8_t* raw, const PixelLayout& layout, ColourPixel* pixels, size_t count,
                const Stream& stream);

/// The levels of an image below the first one.
void halveImage(const ColourImage& image, ColourPixel* pixels, const Stream& stream);

/// Empties the depth image of what hides, `depth_m`.
void clearHiding(const HidingImage& hiding, float* depth_m, const Stream& stream);

/// Lists the voxel arrays of those of the candidates that are in view.
void findArraysInView(const PointView& view, const MapView& map, const LookView& look,
                      const Stream& stream);

/// Draws the surfaces in view into the depth image.
void drawHiding(const PointView& view, const MapView& map, const LookView& look, float* depth_m,
                const Stream& stream);

/// Finds what the image shows of them.
void lookAtSurfaces(const ColourSensing& sensing, const MapView& map, const LookView& look,
                    const Stream& stream);

/// Paints so many samples that were found, where there are bricks of colours.
void paintSurfaces(const ColourRules& rules, const Exposure& exposure, const MapView& map,
                   const LookView& look, size_t samples, const Stream& stream);

}  // namespace gpu
}  // namespace dtsdf
