#include "map/slot_index.h"

#include <algorithm>
#include <new>

namespace dtsdf {
namespace {

constexpr size_t kSmallestTable = 1024;

/// Places of the old table that each insertion is done with. A new table of `size` places has room
/// for size / 4 insertions at least, and the old one is not larger: so half of these would do, but
/// while there are two tables, and one more than half full, searches take longer.
constexpr size_t kPlacesPerStep = 8;

/// Steps ahead for each insertion that is expected.
constexpr size_t kStepsAhead = 2;

}  // namespace

SlotIndex::Place& SlotIndex::Table::placeOf(PackedKey key) const {
  size_t at = homeOf(key);
  while (places[at].mark != kEmpty && places[at].key != key) at = (at + 1) & (size - 1);
  return places[at];
}

SlotIndex::Place* SlotIndex::Table::findLive(PackedKey key) const {
  if (size == 0) return nullptr;
  Place& place = placeOf(key);
  return place.mark > 0 ? &place : nullptr;
}

SlotIndex::Table SlotIndex::makeTable(size_t size) {
  Table table;
  table.places.reset(static_cast<Place*>(std::calloc(size, sizeof(Place))));
  if (table.places == nullptr) throw std::bad_alloc();
  table.size = size;
  return table;
}

SlotIndex::Place* SlotIndex::findLive(PackedKey key) const {
  Place* const place = current_.findLive(key);
  return place == nullptr ? old_.findLive(key) : place;
}

int32_t SlotIndex::find(PackedKey key) const {
  const Place* const place = findLive(key);
  return place == nullptr ? -1 : place->mark - 1;
}

void SlotIndex::put(PackedKey key, int32_t mark) {
  Place& place = current_.placeOf(key);
  if (place.mark == kEmpty) ++current_.used;
  place = {key, mark};
}

void SlotIndex::insert(PackedKey key, int32_t slot) {
  if (2 * current_.used >= current_.size) beginGrowth(size_);
  moveSome();
  if (!putWhereItWillMove(key, slot + 1)) put(key, slot + 1);
  ++size_;
}

/// While entries move, a new one whose turn is still to come goes into the old table. The new table
/// is then written in the order in which the old one is read, so that its memory is first touched
/// page by page, and not all over the place within a few frames.
bool SlotIndex::putWhereItWillMove(PackedKey key, int32_t mark) {
  if (old_.size == 0 || old_.homeOf(key) < moved_) return false;
  Place& place = old_.placeOf(key);
  if (static_cast<size_t>(&place - old_.places.get()) < moved_) return false;  // came round the end
  place = {key, mark};
  return true;
}

void SlotIndex::assign(PackedKey key, int32_t slot) noexcept { findLive(key)->mark = slot + 1; }

void SlotIndex::erase(PackedKey key) noexcept {
  findLive(key)->mark = kErased;
  --size_;
}

void SlotIndex::prepare(size_t insertions) noexcept {
  if (old_.size == 0 && 2 * (current_.used + insertions) >= current_.size) {
    try {
      beginGrowth(size_ + insertions);
    } catch (const std::bad_alloc&) {
      return;
    }
  }
  for (size_t i = 0; i < kStepsAhead * insertions && old_.size != 0; ++i) moveSome();
}

/// A table with room for twice as many keys.
void SlotIndex::beginGrowth(size_t keys) {
  while (old_.size != 0) moveSome();  // a place or two at most, see kPlacesPerStep
  size_t size = std::max(kSmallestTable, current_.size);
  while (size < 4 * keys) size *= 2;
  Table larger = makeTable(size);
  old_ = std::move(current_);
  current_ = std::move(larger);
  moved_ = 0;
}

void SlotIndex::moveSome() {
  const size_t end = std::min(moved_ + kPlacesPerStep, old_.size);
  for (; moved_ < end; ++moved_) {
    Place& place = old_.places[moved_];
    if (place.mark <= 0) continue;
    put(place.key, place.mark);
    place.mark = kErased;  // so that it is not found again once it is erased from current_
  }
  if (moved_ == old_.size) old_ = Table();
}

}  // namespace dtsdf
