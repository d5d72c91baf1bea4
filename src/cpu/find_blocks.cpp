#include "cpu/find_blocks.h"

#include <algorithm>

#include "cpu/columns.h"
#include "cpu/widest_vectors.h"
#include "threads/parallel.h"

namespace dtsdf {

/// A batch of surfels and their lines. Each thread has one.
class LineBatch {
 public:
  bool isFull() const { return count_ == kMax; }
  int count() const { return count_; }
  void clear() { count_ = 0; }

  /// @pre The surfel has a weight, and the batch is not full.
  void add(const Surfel& surfel, uint32_t number) {
    surfels_.set(count_, surfel);
    numbers_[count_++] = number;
  }

  /// Computes the surfels' lines and directions, in loops that compilers vectorise.
  void compute(const FrameSensing& sensing, const FusionSettings& fusion) {
    withWidestVectors([&] { computeAll(sensing, fusion); });
  }

  uint32_t number(int i) const { return numbers_[i]; }
  Surfel surfel(int i) const { return surfels_[i]; }
  SampleLine line(int i) const { return lines_[i]; }
  DirectionSet directions(int i) const { return directions_[i]; }

 private:
  void computeAll(const FrameSensing& of_frame, const FusionSettings& of_fusion) {
    const FrameSensing sensing = of_frame;  // copies, as stores may alias references
    const FusionSettings fusion = of_fusion;
    const int count = count_;
    for (int i = 0; i < count; ++i) lines_.set(i, sampleLineOf(surfels_[i], sensing, fusion));
    const bool directional = fusion.directional != 0;
    for (int i = 0; i < count; ++i) directions_.set(i, lineDirections(surfels_[i], directional));
  }

  static constexpr int kMax = 64;

  int count_ = 0;
  uint32_t numbers_[kMax];
  Columns<Surfel, kMax> surfels_;
  Columns<SampleLine, kMax> lines_;
  Columns<DirectionSet, kMax> directions_;
};

void BlockFinder::Share::reset() {
  used = 0;
  index_.clear();
  for (Vec3i& block_L : cached_block_L_) block_L = {INT32_MAX, 0, 0};
}

BlockFinder::Bin& BlockFinder::Share::find(const Vec3i& block_L, const Vec3i& origin_block) {
  const int line = (block_L.x & 3) | (block_L.y & 3) << 2 | (block_L.z & 3) << 4;
  if (cached_block_L_[line] == block_L) return bins[cached_bin_[line]];
  const PackedKey key = packKey(block_L + origin_block);
  const auto [it, is_new] = index_.emplace(key, used);
  cached_block_L_[line] = block_L;
  cached_bin_[line] = it->second;
  if (!is_new) return bins[it->second];
  if (used == bins.size()) bins.emplace_back();
  Bin& bin = bins[used++];
  bin.block_L = block_L;
  bin.key = key;
  bin.directions = 0;
  bin.surfels.clear();
  return bin;
}

inline void BlockFinder::addLines(const FrameSensing& sensing, LineBatch& batch, Share& share) {
  batch.compute(sensing, fusion_);
  const Vec3i origin_block = blockOfVoxel(sensing.image.frame.origin_voxel);
  for (int i = 0; i < batch.count(); ++i) {
    const uint32_t number = batch.number(i);
    const SampleLine line = batch.line(i);
    const DirectionSet cast = batch.directions(i);
    const uint32_t directions = directionMask(cast);
    const Surfel surfel = batch.surfel(i);
    if (isWide(surfel)) sides_[number] = measuredSides(surfel, sensing.image.frame, line.axis);
    const bool has_sides = isWide(surfel) && sides_[number].areMeasured();
    lines_[number] = {line,
                      {cast.weight[0], cast.weight[1], cast.weight[2]},
                      static_cast<uint8_t>(directions),
                      has_sides};
    visitBlocks(line, [&](const Vec3i& block) {
      Bin& bin = share.find(block, origin_block);
      bin.directions |= directions;
      bin.surfels.push_back(number);
    });
  }
  batch.clear();
}

void BlockFinder::findBlocks(const std::vector<std::vector<Surfel>>& lists,
                             const FrameSensing& sensing) {
  size_t count = 0;
  for (const std::vector<Surfel>& list : lists) count += list.size();
  if (lines_.size() < count) lines_.resize(count);
  if (sides_.size() < count) sides_.resize(count);
  shares_.resize(threads_);
  parallelFor(shares_.size(), threads_, [&](size_t part) {
    Share& share = shares_[part];
    share.reset();
    LineBatch batch;
    const size_t first = count * part / shares_.size(), end = count * (part + 1) / shares_.size();
    size_t begin = 0;  // index of the list's first surfel
    for (const std::vector<Surfel>& list : lists) {
      const size_t last = std::min(begin + list.size(), end);
      for (size_t i = std::max(begin, first); i < last; ++i) {
        const Surfel& surfel = list[i - begin];
        if (surfel.weight > 0.0f) batch.add(surfel, static_cast<uint32_t>(i));
        if (batch.isFull()) withWidestVectors([&] { addLines(sensing, batch, share); });
      }
      begin += list.size();
    }
    addLines(sensing, batch, share);
  });
  merge();
}

size_t BlockFinder::bytes() const {
  size_t bytes = lines_.capacity() * sizeof(StoredLine) + sides_.capacity() * sizeof(MeasuredSides);
  for (const Share& share : shares_) {
    for (const Bin& bin : share.bins) bytes += bin.surfels.capacity() * sizeof(uint32_t);
  }
  return bytes;
}

void BlockFinder::merge() {
  touched_.clear();
  std::unordered_map<PackedKey, size_t> index;
  for (const Share& share : shares_) {
    for (size_t b = 0; b < share.used; ++b) {
      const Bin& bin = share.bins[b];
      const auto [it, is_new] = index.emplace(bin.key, touched_.size());
      if (is_new) touched_.push_back({bin.block_L, bin.key, 0, {}});
      TouchedBlock& block = touched_[it->second];
      block.directions |= bin.directions;
      block.surfels.push_back(&bin.surfels);
    }
  }
}

}  // namespace dtsdf
