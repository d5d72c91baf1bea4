#include "cpu/nearby_arrays.h"

namespace dtsdf {

static_assert(kBlocksAround <= 32, "a bit for each block");

NearbyArrays::NearbyArrays(const BlockTable& table, const VoxelStore& voxels, const BlockKey& key,
                           int32_t least_evidence)
    : table_(table), voxels_(voxels), key_(key) {
  arrays_.least_evidence = least_evidence;
}

void NearbyArrays::lookUp(int n) const {
  found_ |= 1u << n;
  const int32_t slot = table_.find(packKey(key_ + aroundOffset(n)));
  for (int d = 0; d < kDirectionCount; ++d) {
    const int32_t index = slot < 0 ? kNoArray : table_.block(slot).array[d];
    arrays_.array[n][d] = index == kNoArray ? nullptr : voxels_.array(index);
  }
}

}  // namespace dtsdf
