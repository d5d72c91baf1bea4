#include "map/slot_index.h"

#include <gtest/gtest.h>

#include <random>
#include <unordered_map>

namespace dtsdf {
namespace {

TEST(SlotIndex, FindsTheZeroKey) {
  SlotIndex index;
  index.insert(0, 0);
  EXPECT_EQ(index.find(0), 0);
  index.erase(0);
  EXPECT_EQ(index.find(0), -1);
}

/// Key `number` in a grid so coarse that each cube of the index holds only a few keys.
PackedKey numberedKey(unsigned number) {
  constexpr int kApart = 5;
  return packKey({static_cast<int32_t>(number % 17) * kApart - 40,
                  static_cast<int32_t>(number / 17 % 19) * kApart,
                  static_cast<int32_t>(number / (17 * 19)) * kApart});
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

/// Compares the index with a standard library map, for few and for many erasures.
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
      if (step % 5000 == 0) expectEqual(index, truth, kLastKey);
    }
    expectEqual(index, truth, kLastKey);
    index.clear();
    EXPECT_EQ(index.find(1), -1);
    EXPECT_EQ(index.size(), 0u);
  }
}

/// Keys are inserted and erased as in a map that keeps only the blocks near a moving camera.
TEST(SlotIndex, ReusesTheMemoryOfErasedKeys) {
  constexpr int32_t kKept = 20, kApart = 8;
  const auto key_at = [](int32_t step) { return packKey({step * kApart, 0, 0}); };
  SlotIndex index;
  size_t most = 0;
  for (int32_t step = 0; step < 10000; ++step) {
    index.insert(key_at(step), step);
    if (step >= kKept) index.erase(key_at(step - kKept));
    if (step == 10 * kKept) most = index.memoryBytes();
    if (step > 10 * kKept) {
      ASSERT_LE(index.memoryBytes(), most) << step;
    }
  }
  EXPECT_EQ(index.size(), static_cast<size_t>(kKept));
}

}  // namespace
}  // namespace dtsdf
