/// The stage "paint" on the device: a colour image onto the surfaces that it sees.
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

/// What the host has to know of an image's look at the map.
struct LookCounters {
  uint32_t blocks, arrays;  ///< In view: blocks, and their voxel arrays.
  uint32_t seen;            ///< Arrays in view that something is to be painted in.
  uint32_t requests;        ///< Such arrays that lack bricks of colours for it.
  ExposureSums sums;
  uint64_t samples;  ///< Voxels that the image was found to show, also those without room.
};

/// What an image shows of a voxel, until there are bricks of colours to paint it in.
struct FoundSample {
  int32_t slot;    ///< Slot of its block.
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
  BlockExtent painted;  ///< Blocks elsewhere only hide what is behind them.
};

/// Paints an image in steps: takes it, looks at what it shows, and paints that, once the bricks of
/// colours are there that it needs. The image comes by a stream of its own: it needs no map, and
/// so comes while the depth image is still being fused.
class Painter {
 public:
  Painter(const PaintSettings& settings, const Stream& stream);
  ~Painter() { image_stream_.drain(); }

  /// Enqueues what needs no map; the image is not needed any more on return.
  void takeImage(const ColourFrame& frame);

  /// Finds what it shows of the map's surfaces; only those in `painted` are painted. Waits for the
  /// result. @throws BackendError without memory; the map is untouched.
  void look(const FrameView& view, int32_t least_evidence, const std::vector<int32_t>& in_view,
            const BlockExtent& painted, const MapView& map);
  const LookCounters& counters() const { return pinned_counters_[0]; }

  /// The bricks of colours that are not there.
  std::vector<ColourRequest> fetchRequests();

  /// Enqueues the painting of what was found, as far as there are bricks for it.
  void paint(const Exposure& exposure, const MapView& map);

  void addMemory(MapperMemory& memory) const;

 private:
  void reserveImages(int32_t width, int32_t height);
  void takeCandidates(const std::vector<int32_t>& in_view);
  void findHiding(const MapView& map);
  void findSamples(const MapView& map);
  LookView view() const {
    return {counters_.data(), samples_.data(), samples_.capacity(), candidates_.data(),
            candidate_count_, arrays_.data(),  requests_.data(),    painted_};
  }

  const PaintSettings settings_;
  BlockExtent painted_;
  const Stream& stream_;
  const int thread_blocks_;  ///< That fill the device, for kernels whose work is counted there.
  Stream image_stream_;
  Event taken_, looked_;
  ColourSensing sensing_ = {};
  RawImage raw_image_;
  DeviceBuffer<ColourPixel> pixels_;
  DeviceBuffer<float> hiding_m_;
  DeviceBuffer<FoundSample> samples_;
  bool is_looking_ = false;  ///< At an image, with a result that nobody has waited for.
  uint32_t candidate_count_ = 0;
  PinnedBuffer<int32_t> candidates_;  ///< Kernels read it in place.
  DeviceBuffer<int32_t> arrays_;
  DeviceBuffer<ColourRequest> requests_;
  DeviceBuffer<LookCounters> counters_;
  PinnedBuffer<LookCounters> pinned_counters_;
  PinnedBuffer<ColourRequest> pinned_requests_;
};

}  // namespace gpu
}  // namespace dtsdf
