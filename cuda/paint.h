/// The stage "paint" on the device: paints a colour image onto the surfaces visible in it.
#pragma once

#include <vector>

#include "backend/map_backend.h"
#include "device_map.h"
#include "dtsdf_mapping/colour_frame.h"
#include "dtsdf_mapping/mapper.h"
#include "kernels/colour/paint.h"
#include "map/block_table.h"
#include "raw_image.h"
#include "runtime/buffer.h"

namespace dtsdf {
namespace gpu {

/// Counters for one colour image, read by the host.
struct PaintCounters {
  uint32_t blocks, arrays;  ///< Numbers of blocks in view and of their arrays.
  uint32_t seen;            ///< Arrays with voxels that will be painted.
  uint32_t requests;        ///< Arrays that lack bricks (4 x 4 x 4 voxels) to be painted.
  ExposureSums sums;
  uint64_t samples;  ///< Voxels to be painted, including those that did not fit.
};

/// The colour of a voxel in an image, stored until the voxel can be painted.
struct FoundSample {
  int32_t slot;
  uint16_t voxel;  ///< kVoxelsPerBlock * direction + index.
  ColourSample sample;
};

/// What kernels of Painter::findColours() need, passed by value.
struct PaintView {
  PaintCounters* counters;
  FoundSample* samples;  ///< Samples that do not fit are only counted.
  uint64_t max_samples;
  const int32_t* candidates;  ///< Slots of all blocks that may be in view, possibly with others.
  uint32_t candidate_count;
  int32_t* arrays;  ///< The voxel arrays in view: kDirectionCount * slot + direction.
  ColourRequest* requests;
  BlockExtent painted;  ///< Blocks outside it are not painted, but they do occlude.
};

/// Paints an image in steps: takeImage(), findColours(), and paint() once the bricks for its
/// colours exist. Images are uploaded on a separate stream, possibly while a depth image is being
/// fused.
class Painter {
 public:
  Painter(const PaintSettings& settings, const Stream& stream);
  ~Painter() { image_stream_.drain(); }

  /// Enqueues the steps that do not need the map. The image may be freed on return.
  void takeImage(const ColourFrame& frame);

  /// Finds the surfaces in `painted` that are visible in the image, and waits for the result.
  /// @param in_view Slots of all blocks that may be in view, and possibly of other blocks.
  /// @throws BackendError if memory runs out; the map is not changed.
  void findColours(const FrameView& view, int32_t min_evidence, const std::vector<int32_t>& in_view,
                   const BlockExtent& painted, const MapView& map);
  const PaintCounters& counters() const { return pinned_counters_[0]; }

  /// The missing colour bricks. Waits for the result.
  std::vector<ColourRequest> fetchRequests();

  /// Enqueues painting the surfaces that findColours() found, where bricks exist.
  void paint(const Exposure& exposure, const MapView& map);

  void addMemory(MapperMemory& memory) const;

 private:
  void reserveImages(int32_t width, int32_t height);
  void takeCandidates(const std::vector<int32_t>& in_view);
  void findHiding(const MapView& map);
  void findSamples(const MapView& map);
  PaintView view() const {
    return {counters_.data(), samples_.data(), samples_.capacity(), candidates_.data(),
            candidate_count_, arrays_.data(),  requests_.data(),    painted_};
  }

  const PaintSettings settings_;
  BlockExtent painted_;
  const Stream& stream_;
  const int thread_blocks_;  ///< Enough to fill the device; kernels use grid-stride loops.
  Stream image_stream_;
  Event taken_, found_;
  ColourSensing sensing_ = {};
  RawImage raw_image_;
  DeviceBuffer<ColourPixel> pixels_;
  DeviceBuffer<float> hiding_m_;
  DeviceBuffer<FoundSample> samples_;
  bool is_finding_ = false;  ///< Whether findColours() has enqueued work without waiting for it.
  uint32_t candidate_count_ = 0;
  PinnedBuffer<int32_t> candidates_;  ///< Read in place by kernels.
  DeviceBuffer<int32_t> arrays_;
  DeviceBuffer<ColourRequest> requests_;
  DeviceBuffer<PaintCounters> counters_;
  PinnedBuffer<PaintCounters> pinned_counters_;
  PinnedBuffer<ColourRequest> pinned_requests_;
};

}  // namespace gpu
}  // namespace dtsdf
