#include "map/slot_index.h"

#include <algorithm>
#include <iterator>
#include <new>
#include <utility>

namespace dtsdf {
namespace {

constexpr size_t kSmallestTable = 256;

/// Places of the old table that each insertion is done with. A new table of `size` places has room
/// for size / 4 insertions at least, and the old one is not larger: so none is left by then.
constexpr size_t kPlacesPerStep = 4;

/// Steps ahead for each insertion that is expected.
constexpr size_t kStepsAhead = 2;

}  // namespace

bool SlotIndex::Cube::holdsAny() const {
  return std::any_of(std::begin(marks), std::end(marks), [](int32_t mark) { return mark != 0; });
}

SlotIndex::Cube& SlotIndex::Table::placeOf(PackedKey name) const {
  size_t at = homeOf(name);
  while (cubes[at].name != 0 && cubes[at].name != name) at = (at + 1) & (size - 1);
  return cubes[at];
}

SlotIndex::Table SlotIndex::makeTable(size_t size) {
  Table table;
  table.cubes.reset(static_cast<Cube*>(std::calloc(size, sizeof(Cube))));
  if (table.cubes == nullptr) throw std::bad_alloc();
  table.size = size;
  return table;
}

/// Null where the key is not there.
int32_t* SlotIndex::findMark(PackedKey key) const {
  for (const Table* table : {&current_, &old_}) {
    if (table->size == 0) continue;
    int32_t& mark = table->placeOf(nameOf(key)).markOf(key);
    if (mark != 0) return &mark;
  }
  return nullptr;
}

int32_t SlotIndex::find(PackedKey key) const {
  const int32_t* const mark = findMark(key);
  return mark == nullptr ? -1 : *mark - 1;
}

SlotIndex::Cube& SlotIndex::placeInCurrent(PackedKey name) {
  Cube& cube = current_.placeOf(name);
  if (cube.name == 0) ++current_.used;
  return cube;
}

void SlotIndex::insert(PackedKey key, int32_t slot) {
  if (2 * current_.used >= current_.size) beginGrowth(cubes_);
  moveSome();
  const PackedKey name = nameOf(key);
  Cube* const in_old = placeWhereItWillMove(name);
  Cube& cube = in_old == nullptr ? placeInCurrent(name) : *in_old;
  if (!cube.holdsAny()) ++cubes_;
  cube.name = name;
  cube.markOf(key) = slot + 1;
  ++size_;
}

/// While cubes move, one whose turn is still to come is in the old table, or goes there. The new
/// table is then written in the order in which the old one is read, so that its memory is first
/// touched page by page, and not all over the place within a few frames.
SlotIndex::Cube* SlotIndex::placeWhereItWillMove(PackedKey name) {
  if (old_.size == 0 || old_.homeOf(name) < moved_) return nullptr;
  Cube& cube = old_.placeOf(name);
  const bool came_round_the_end = static_cast<size_t>(&cube - old_.cubes.get()) < moved_;
  return came_round_the_end ? nullptr : &cube;
}

void SlotIndex::assign(PackedKey key, int32_t slot) noexcept { *findMark(key) = slot + 1; }

void SlotIndex::erase(PackedKey key) noexcept {
  for (Table* table : {&current_, &old_}) {
    if (table->size == 0) continue;
    Cube& cube = table->placeOf(nameOf(key));
    if (cube.markOf(key) == 0) continue;
    cube.markOf(key) = 0;
    if (!cube.holdsAny()) --cubes_;
    --size_;
    return;
  }
}

void SlotIndex::prepare(size_t insertions) noexcept {
  if (old_.size == 0 && 2 * (current_.used + insertions) >= current_.size) {
    try {
      beginGrowth(cubes_ + insertions);
    } catch (const std::bad_alloc&) {
      return;
    }
  }
  for (size_t i = 0; i < kStepsAhead * insertions && old_.size != 0; ++i) moveSome();
}

/// A table with room for twice as many cubes.
void SlotIndex::beginGrowth(size_t cubes) {
  while (old_.size != 0) moveSome();  // a place or two at most, see kPlacesPerStep
  size_t size = std::max(kSmallestTable, current_.size);
  while (size < 4 * cubes) size *= 2;
  Table larger = makeTable(size);
  old_ = std::move(current_);
  current_ = std::move(larger);
  moved_ = 0;
}

void SlotIndex::moveSome() {
  const size_t end = std::min(moved_ + kPlacesPerStep, old_.size);
  for (; moved_ < end; ++moved_) {
    Cube& from = old_.cubes[moved_];
    if (!from.holdsAny()) continue;
    Cube& to = placeInCurrent(from.name);  // some of its keys may have gone there, past its home
    if (to.holdsAny()) --cubes_;
    to.name = from.name;
    for (size_t i = 0; i < std::size(from.marks); ++i) {
      if (from.marks[i] != 0) to.marks[i] = std::exchange(from.marks[i], 0);  // not found again
    }
  }
  if (moved_ == old_.size) old_ = Table();
}

}  // namespace dtsdf
