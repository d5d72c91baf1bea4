#include "tiles/frame_ledger.h"

#include "backend/rule_settings.h"

namespace dtsdf {

void FrameLedger::add(const DepthFrame& frame, RecordedIndex number,
                      const std::vector<BlockRequest>& touched) {
  for (const BlockRequest& block : touched) touch(block, number);
  if (needsFreeDepth(params_)) lookThrough(frame, number);
}

void FrameLedger::close() {
  for (const auto& [key, directions] : blocks_) {
    places_[placeOf(unpackKey(key))].blocks.push_back({key, directions});
  }
}

Place FrameLedger::placeOf(const BlockKey& key) const {
  const auto at = [this](int32_t x) { return floorDivided(x, place_blocks_); };
  return {at(key.z), at(key.y), at(key.x)};
}

IndexRanges& FrameLedger::ofRecording(std::vector<IndexRanges>& frames, size_t recording) const {
  frames.resize(recordings_);
  return frames[recording];
}

/// What feet of voxels may lie in: they are as far from them as the truncation.
MetricBox FrameLedger::boxOfFeet(const BlockExtent& extent) const {
  const double margin_m =
      static_cast<double>(params_.map.voxel_size_m * (params_.map.truncation_voxels + 2.0f));
  return boxOf(extent, blockSize_m(), margin_m);
}

void FrameLedger::touch(const BlockRequest& block, RecordedIndex frame) {
  blocks_[block.key] |= block.directions;
  const BlockKey key = unpackKey(block.key);
  ++places_[placeOf(key)].touched_blocks;
  // Of the places that the block belongs to, halo included.
  const BlockExtent near{key - Vec3i{kHaloBehind, kHaloBehind, kHaloBehind},
                         key + Vec3i{kHaloBefore, kHaloBefore, kHaloBefore}};
  visitGrid(near, place_blocks_, [&](const Place& place) {
    PlaceInWork& in_work = places_[place];
    in_work.is_touched = true;
    ofRecording(in_work.frames, frame.recording).add(frame.index);
  });
}

/// A frame that touches nothing of a place may clear what is there already, and see cells free.
void FrameLedger::lookThrough(const DepthFrame& frame, RecordedIndex number) {
  const ViewReach reach(frame, params_);
  if (clearsFreeSpace(params_)) {
    for (auto& [place, in_work] : places_) {
      if (!in_work.is_touched) continue;
      IndexRanges& frames = ofRecording(in_work.frames, number.recording);
      if (frames.contains(number.index)) continue;
      if (reach.mayPass(boxOfFeet(withHalo(extentOf(place))))) frames.add(number.index);
    }
  }
  if (params_.space.enabled) seeFree(reach, number);
}

/// Notes the places whose cells a frame may see free.
void FrameLedger::seeFree(const ViewReach& reach, RecordedIndex frame) {
  const auto range_m = static_cast<double>(params_.space.max_range_m);
  BlockExtent view = blocksIn(reach.boundsUpTo(range_m), blockSize_m());
  const int beyond = blocksPerCube(params_.space.cell_voxels);
  view.first = view.first - Vec3i{beyond, beyond, beyond};
  visitGrid(view, place_blocks_, [&](const Place& place) {
    const BlockExtent cells = withCubes(extentOf(place), params_.space.cell_voxels);
    const double margin_m = static_cast<double>(params_.map.voxel_size_m);
    if (!reach.mayPass(boxOf(cells, blockSize_m(), margin_m))) return;
    ofRecording(places_[place].passing, frame.recording).add(frame.index);
  });
}

}  // namespace dtsdf
