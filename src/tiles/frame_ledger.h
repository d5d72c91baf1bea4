/// Which frames come by where, and which blocks they touch: an account by places, the boxes of a
/// grid of blocks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "dtsdf_mapping/depth_frame.h"
#include "dtsdf_mapping/params/mapper_params.h"
#include "map/block_table.h"
#include "tiles/pinhole_view.h"
#include "tiles/tile.h"
#include "tiles/view_reach.h"

namespace dtsdf {

/// Numbers of a box of a grid along the axes: z, y, x.
using Place = std::array<int32_t, 3>;

/// Calls visit(place) for the boxes of a grid that have something of an extent.
template <class Visit>
void visitGrid(const BlockExtent& extent, int edge, const Visit& visit) {
  const auto at = [edge](int32_t x) { return floorDivided(x, edge); };
  for (int32_t z = at(extent.first.z); z <= at(extent.last.z); ++z) {
    for (int32_t y = at(extent.first.y); y <= at(extent.last.y); ++y) {
      for (int32_t x = at(extent.first.x); x <= at(extent.last.x); ++x) visit(Place{z, y, x});
    }
  }
}

inline BlockExtent boxOfGrid(const Place& place, int edge) {
  const BlockKey first{place[2] * edge, place[1] * edge, place[0] * edge};
  return {first, {first.x + edge - 1, first.y + edge - 1, first.z + edge - 1}};
}

/// A box of blocks that frames have come by.
struct PlaceInWork {
  std::vector<IndexRanges> frames;   ///< By recording: that touch it, halo included, or clear it.
  std::vector<IndexRanges> passing;  ///< By recording: that may see its cells free.
  size_t touched_blocks = 0;         ///< By all frames, without halo.
  bool is_touched = false;           ///< Halo included.
  std::vector<BlockRequest> blocks;  ///< Of the whole map, without halo; in the end.
};

/// An image of a recording, by their numbers.
struct RecordedIndex {
  size_t recording, index;
};

/// Errs on the side of more.
class FrameLedger {
 public:
  /// Of places with edges of so many blocks.
  FrameLedger(const MapperParams& params, int place_blocks, size_t recordings)
      : params_(params), place_blocks_(place_blocks), recordings_(recordings) {}

  size_t recordings() const { return recordings_; }

  /// Notes a frame: the blocks that it touches, and what it looks through.
  void add(const DepthFrame& frame, RecordedIndex number, const std::vector<BlockRequest>& touched);

  /// Once all frames are noted: gives each place its blocks.
  void close();

  const std::map<Place, PlaceInWork>& places() const { return places_; }
  BlockExtent extentOf(const Place& place) const { return boxOfGrid(place, place_blocks_); }

  /// Calls visit(extent, place) for the places with something of an extent that frames came by.
  template <class Visit>
  void visitPlaces(const BlockExtent& extent, const Visit& visit) const {
    double boxes = 1.0;
    for (const int32_t edge : {extent.last.x - extent.first.x, extent.last.y - extent.first.y,
                               extent.last.z - extent.first.z}) {
      boxes *= 2.0 + static_cast<double>(edge) / place_blocks_;
    }
    if (boxes > static_cast<double>(places_.size())) {
      for (const auto& [place, in_work] : places_) {
        if (overlap(extentOf(place), extent)) visit(extentOf(place), in_work);
      }
      return;
    }
    visitGrid(extent, place_blocks_, [&](const Place& place) {
      const auto found = places_.find(place);
      if (found != places_.end()) visit(extentOf(place), found->second);
    });
  }

 private:
  double blockSize_m() const { return static_cast<double>(params_.map.voxel_size_m) * kBlockSide; }
  Place placeOf(const BlockKey& key) const;
  IndexRanges& ofRecording(std::vector<IndexRanges>& frames, size_t recording) const;
  MetricBox boxOfFeet(const BlockExtent& extent) const;
  void touch(const BlockRequest& block, RecordedIndex frame);
  void lookThrough(const DepthFrame& frame, RecordedIndex number);
  void seeFree(const ViewReach& reach, RecordedIndex frame);

  const MapperParams params_;
  const int place_blocks_;
  const size_t recordings_;
  std::unordered_map<PackedKey, uint32_t> blocks_;  ///< Directions of those that were touched.
  std::map<Place, PlaceInWork> places_;
};

}  // namespace dtsdf
