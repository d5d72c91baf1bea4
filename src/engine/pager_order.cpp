// The order in which blocks leave memory.
#include <algorithm>

#include "engine/pager.h"
#include "kernels/core/direction.h"

namespace dtsdf {
namespace {

/// Nothing that can go is smaller.
constexpr size_t kLeastBytes = BlockTable::kBlockBytes + BlockTable::kArrayBytes;

/// Blocks that may go are listed for so many times at once.
constexpr size_t kListedAtOnce = 8;

}  // namespace

uint64_t Pager::lastNeed(int32_t slot) const {
  const auto place = static_cast<size_t>(slot);
  return place < last_need_.size() ? last_need_[place] : 0;
}

void Pager::touch(int32_t slot) {
  const auto place = static_cast<size_t>(slot);
  if (last_need_.size() <= place) last_need_.resize(table_.slotCount(), 0);
  last_need_[place] = now_;
}

/// Blocks that were not brought in last, at least so many bytes of them if there are, by key those
/// that were needed at the same time. More are listed than are asked for: all others were needed
/// later, so that the rest of the list goes next, but for what was needed again.
std::vector<int32_t> Pager::leastRecent(size_t bytes) {
  std::vector<int32_t> slots;
  size_t found = 0;
  const auto take = [&] {
    for (; found < bytes && next_oldest_ < oldest_.size(); ++next_oldest_) {
      const Candidate& candidate = oldest_[next_oldest_];
      const BlockEntry& entry = table_.block(candidate.slot);
      const bool is_same = entry.in_use && packKey(entry.key) == candidate.key &&
                           lastNeed(candidate.slot) == candidate.last_need;
      if (!is_same || candidate.last_need == now_ || directionsWithArrays(entry) == 0) continue;
      found += table_.bytesOf(candidate.slot);
      slots.push_back(candidate.slot);
    }
  };
  take();
  if (found >= bytes) return slots;
  slots.clear();
  found = 0;
  findOldest(kListedAtOnce * bytes);
  take();
  return slots;
}

void Pager::findOldest(size_t bytes) {
  oldest_.clear();
  next_oldest_ = 0;
  for (size_t i = 0; i < table_.slotCount(); ++i) {
    const auto slot = static_cast<int32_t>(i);
    const BlockEntry& entry = table_.block(slot);
    if (!entry.in_use || lastNeed(slot) == now_ || directionsWithArrays(entry) == 0) continue;
    oldest_.push_back({lastNeed(slot), packKey(entry.key), slot});
  }
  const auto goes_before = [](const Candidate& a, const Candidate& b) {
    return a.last_need != b.last_need ? a.last_need < b.last_need : a.key < b.key;
  };
  const size_t most = std::min(oldest_.size(), bytes / kLeastBytes + 1);
  const auto end = oldest_.begin() + static_cast<std::ptrdiff_t>(most);
  std::nth_element(oldest_.begin(), end, oldest_.end(), goes_before);
  oldest_.erase(end, oldest_.end());
  std::sort(oldest_.begin(), oldest_.end(), goes_before);
}

}  // namespace dtsdf
