#include "map/slot_index.h"

#include <gtest/gtest.h>

#include <random>
#include <unordered_map>

namespace dtsdf {
namespace {

TEST(SlotIndex, KnowsNothingAtFirst) {
  const SlotIndex index;
  EXPECT_EQ(index.find(0), -1);
  EXPECT_EQ(index.size(), 0u);
}

TEST(SlotIndex, FindsTheKeyWhoseBitsAreAllZero) {
  SlotIndex index;
  index.insert(0, 0);
  EXPECT_EQ(index.find(0), 0);
  index.erase(0);
  EXPECT_EQ(index.find(0), -1);
}

/// Keys by number, of a cube of blocks along x, y and z.
PackedKey numberedKey(unsigned number) {
  return packKey({static_cast<int32_t>(number % 17), static_cast<int32_t>(number / 17 % 19),
                  static_cast<int32_t>(number / (17 * 19))});
}

void expectEqual(const SlotIndex& index, const std::unordered_map<PackedKey, int32_t>& truth,
                 unsigned last_key) {
  ASSERT_EQ(index.size(), truth.size());
  for (unsigned number = 0; number <= last_key; ++number) {
    const PackedKey key = numberedKey(number);
    const auto it = truth.find(key);
    ASSERT_EQ(index.find(key), it == truth.end() ? -1 : it->second) << key;
  }
}

/// Against a table of the standard library, also while entries are moving, with work done ahead,
/// and with more erased than kept.
TEST(SlotIndex, FollowsInsertionsAndErasures) {
  constexpr unsigned kLastKey = 6000;
  std::mt19937 random(7);
  for (const unsigned erase_percent : {5u, 45u, 55u}) {
    SlotIndex index;
    std::unordered_map<PackedKey, int32_t> truth;
    for (int step = 0; step < 60000; ++step) {
      const PackedKey key = numberedKey(random() % (kLastKey + 1));
      const bool is_there = truth.count(key) > 0;
      ASSERT_EQ(index.find(key), is_there ? truth[key] : -1);
      if (is_there && random() % 100 < 2 * erase_percent) {
        index.erase(key);
        truth.erase(key);
      } else if (!is_there) {
        index.insert(key, step);
        truth[key] = step;
      }
      if (step % 97 == 0) index.prepare(random() % 200);
      if (step % 5000 == 0) expectEqual(index, truth, kLastKey);
    }
    expectEqual(index, truth, kLastKey);
    index.clear();
    EXPECT_EQ(index.find(1), -1);
    EXPECT_EQ(index.size(), 0u);
  }
}

/// Keys of a cube on both sides of where entries have moved to: one table in six meets that.
TEST(SlotIndex, KeepsAllKeysOfACubeThatMoves) {
  constexpr unsigned kKeys = 6000, kTables = 100;
  std::mt19937 random(7);
  for (unsigned table = 0; table < kTables; ++table) {
    SlotIndex index;
    std::unordered_map<PackedKey, int32_t> truth;
    for (int step = 0; step < 4000; ++step) {
      const PackedKey key = numberedKey(static_cast<unsigned>(random() % kKeys));
      if (truth.emplace(key, step).second) index.insert(key, step);
    }
    ASSERT_NO_FATAL_FAILURE(expectEqual(index, truth, kKeys)) << table;
  }
}

}  // namespace
}  // namespace dtsdf
