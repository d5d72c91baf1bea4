#include "cpu/find_blocks.h"

#include <algorithm>

#include "threads/parallel.h"

namespace dtsdf {

void BlockFinder::Share::reset() {
  bins.clear();
  entries.clear();
  index.clear();
  for (CacheLine& line : cache_) line = {{INT32_MAX, 0, 0}, 0};
}

uint32_t BlockFinder::Share::findBin(const Vec3i& block_L, const Vec3i& origin_block) {
  CacheLine& line = cache_[(block_L.x & 3) | (block_L.y & 3) << 2 | (block_L.z & 3) << 4];
  if (line.block_L == block_L) return line.bin;
  const PackedKey key = packKey(block_L + origin_block);
  const auto [it, is_new] = index.emplace(key, static_cast<uint32_t>(bins.size()));
  if (is_new) bins.push_back({block_L, key, 0, 0});
  line = {block_L, it->second};
  return it->second;
}

void BlockFinder::Share::add(const Vec3i& block_L, const Vec3i& origin_block, uint32_t directions,
                             uint32_t surfel) {
  const uint32_t at = findBin(block_L, origin_block);
  Bin& bin = bins[at];
  bin.directions |= directions;
  ++bin.count;
  entries.push_back({at, surfel});
}

void BlockFinder::Share::order() {
  begin.assign(bins.size() + 1, 0);
  for (size_t b = 0; b < bins.size(); ++b) begin[b + 1] = begin[b] + bins[b].count;
  ordered.resize(entries.size());
  std::vector<uint32_t> next(begin.begin(), begin.end());
  for (const Entry& entry : entries) ordered[next[entry.bin]++] = entry.surfel;
}

void BlockFinder::addLines(const FrameSensing& sensing, LineBatch& batch, Share& share) {
  batch.compute(sensing, fusion_);
  const Vec3i origin_block = blockOfVoxel(sensing.image.frame.origin_voxel);
  for (int i = 0; i < batch.count(); ++i) {
    const uint32_t number = batch.number(i);
    const CastLine cast = batch.line(i, sensing.image.frame);
    const float* weight = cast.directions.weight;
    const uint32_t directions = directionMask(cast.directions);
    const bool has_sides = cast.sides.areMeasured();
    lines_[number] = {
        cast.line, {weight[0], weight[1], weight[2]}, static_cast<uint8_t>(directions), has_sides};
    if (has_sides) sides_[number] = cast.sides;
    visitBlocks(cast.line,
                [&](const Vec3i& block) { share.add(block, origin_block, directions, number); });
  }
  batch.clear();
}

void BlockFinder::findBlocks(const std::vector<std::vector<Surfel>>& lists,
                             const FrameSensing& sensing) {
  size_t count = 0;
  for (const std::vector<Surfel>& list : lists) count += list.size();
  lines_.makeRoom(count);
  sides_.makeRoom(count);
  shares_.resize(threads_);
  parallelFor(shares_.size(), threads_, [&](size_t part) {
    Share& share = shares_[part];
    share.reset();
    LineBatch batch;
    const size_t first = count * part / shares_.size(), end = count * (part + 1) / shares_.size();
    size_t begin = 0;  // of the list
    for (const std::vector<Surfel>& list : lists) {
      const size_t last = std::min(begin + list.size(), end);
      for (size_t i = std::max(begin, first); i < last; ++i) {
        const Surfel& surfel = list[i - begin];
        if (surfel.weight > 0.0f) batch.add(surfel, static_cast<uint32_t>(i));
        if (batch.isFull()) addLines(sensing, batch, share);
      }
      begin += list.size();
    }
    addLines(sensing, batch, share);
    share.order();
  });
  merge();
}

size_t BlockFinder::bytes() const {
  size_t bytes = lines_.bytes() + sides_.bytes();
  for (const Share& share : shares_) {
    bytes += share.entries.capacity() * sizeof(Entry) + share.ordered.capacity() * sizeof(uint32_t);
  }
  return bytes;
}

void BlockFinder::merge() {
  touched_.clear();
  std::unordered_map<PackedKey, size_t, KeyHash> index;
  for (const Share& share : shares_) {
    for (size_t b = 0; b < share.bins.size(); ++b) {
      const Bin& bin = share.bins[b];
      const auto [it, is_new] = index.emplace(bin.key, touched_.size());
      if (is_new) touched_.push_back({bin.block_L, bin.key, 0, {}});
      TouchedBlock& block = touched_[it->second];
      block.directions |= bin.directions;
      block.surfels.push_back(
          {share.ordered.data() + share.begin[b], share.ordered.data() + share.begin[b + 1]});
    }
  }
}

}  // namespace dtsdf
