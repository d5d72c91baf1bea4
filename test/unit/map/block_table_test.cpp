#include "map/block_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

namespace dtsdf {
namespace {

constexpr size_t kArray = BlockTable::kArrayBytes, kBlock = BlockTable::kBlockBytes;
constexpr size_t kPlenty = size_t(1) << 30;

PackedKey keyOf(int x, int y = 0, int z = 0) { return packKey({x, y, z}); }

std::vector<BlockRequest> randomRequests(std::mt19937& random, int count) {
  std::uniform_int_distribution<int> coordinate(-4, 4);
  std::vector<BlockRequest> requests;
  for (int i = 0; i < count; ++i) {
    requests.push_back({keyOf(coordinate(random), coordinate(random), coordinate(random)),
                        static_cast<uint32_t>(1 + random() % 63)});
  }
  return requests;
}

/// Checks that the counts add up and that no index is in use twice.
void expectConsistent(const BlockTable& table) {
  std::set<int32_t> arrays, slots;
  PackedKey previous = 0;
  for (const int32_t slot : table.sortedSlots()) {
    const BlockEntry& entry = table.block(slot);
    EXPECT_TRUE(entry.in_use);
    EXPECT_TRUE(slots.insert(slot).second);
    EXPECT_LT(static_cast<size_t>(slot), table.slotCount());
    const PackedKey key = packKey(entry.key);
    EXPECT_GT(key, previous);
    previous = key;
    EXPECT_EQ(table.find(key), slot);
    for (const int32_t array : entry.array) {
      if (array == kNoArray) continue;
      EXPECT_TRUE(arrays.insert(array).second) << "array " << array << " should be used only once";
      EXPECT_LT(static_cast<size_t>(array), table.arrayCount());
    }
  }
  EXPECT_EQ(table.blocksInUse(), slots.size());
  EXPECT_EQ(table.arraysInUse(), arrays.size());
  EXPECT_EQ(table.bytesInUse(), slots.size() * kBlock + arrays.size() * kArray);
}

void expectEqual(const BlockTable& a, const BlockTable& b) {
  ASSERT_EQ(a.sortedSlots(), b.sortedSlots());
  for (const int32_t slot : a.sortedSlots()) {
    EXPECT_TRUE(a.block(slot).key == b.block(slot).key);
    for (int d = 0; d < kDirectionCount; ++d) {
      EXPECT_EQ(a.block(slot).array[d], b.block(slot).array[d]);
    }
  }
}

TEST(BlockTable, IgnoresBlocksOutsideItsExtent) {
  BlockTable table(2 * (kBlock + 6 * kArray));
  table.restrictTo({{{0, 0, 0}, {1, 5, 5}}, BlockExtent(), BlockExtent()});
  std::vector<BlockRequest> requests;
  for (int x = -3; x < 20; ++x) requests.push_back({keyOf(x), 0x3f});
  const PoolSizes count = table.countNew(requests);
  EXPECT_EQ(count.slots, 2u);
  EXPECT_EQ(count.arrays, 12u);
  const Admission admission = table.admit(requests);
  EXPECT_EQ(admission.refused, 0u) << "blocks outside the extent should not count as refused";
  EXPECT_EQ(admission.changed_slots.size(), 2u);
  EXPECT_LT(table.find(requests.back().key), 0);
  expectConsistent(table);
  table.clear();
  EXPECT_TRUE(table.admit({{keyOf(7), 1}}).changed_slots.empty());
}

/// allocate() followed by publish() has the same effect as admit(), even if some blocks exist
/// already and the budget runs out.
TEST(BlockTable, AllocateAndPublishMatchAdmit) {
  std::mt19937 random(11);
  BlockTable at_once(300 * kArray), deferred(300 * kArray);
  for (int frame = 0; frame < 20; ++frame) {
    const std::vector<BlockRequest> requests = randomRequests(random, 40);
    const Admission expected = at_once.admit(requests);
    const Admission actual = deferred.allocate(requests);
    EXPECT_EQ(actual.changed_slots, expected.changed_slots);
    EXPECT_EQ(actual.new_arrays, expected.new_arrays);
    EXPECT_EQ(actual.refused, expected.refused);
    EXPECT_EQ(deferred.bytesInUse(), at_once.bytesInUse());
    deferred.publish();
    expectConsistent(deferred);
    expectEqual(deferred, at_once);
    size_t listed = 0;
    for (const BlockCells::Cell& cell : deferred.cells()) listed += cell.slots.size();
    EXPECT_EQ(listed, deferred.blocksInUse());
  }
}

TEST(BlockTable, TheBudgetIsExact) {
  BlockTable table(2 * (kBlock + 3 * kArray));
  EXPECT_EQ(table.admit({{keyOf(1), 0x07}, {keyOf(2), 0x38}}).refused, 0u);
  EXPECT_EQ(table.bytesInUse(), 2 * (kBlock + 3 * kArray));
  EXPECT_EQ(table.admit({{keyOf(3), 0x01}}).refused, 1u);
  BlockTable smaller(2 * (kBlock + 3 * kArray) - 1);
  EXPECT_EQ(smaller.admit({{keyOf(1), 0x07}, {keyOf(2), 0x38}}).refused, 1u);
  EXPECT_GE(smaller.find(keyOf(1)), 0);
  EXPECT_EQ(smaller.find(keyOf(2)), -1);
}

TEST(BlockTable, ARefusedRequestLeavesNothingBehind) {
  BlockTable table(kBlock + 2 * kArray);
  table.admit({{keyOf(1), 0x01}});
  const Admission admission = table.admit({{keyOf(1), 0x07}, {keyOf(2), 0x01}});
  EXPECT_EQ(admission.refused, 2u);
  EXPECT_TRUE(admission.changed_slots.empty());
  EXPECT_TRUE(admission.new_arrays.empty());
  EXPECT_EQ(table.arraysInUse(), 1u);
  EXPECT_EQ(table.find(keyOf(2)), -1);
  // Existing arrays can still be requested, and arrays that fit are still allocated.
  EXPECT_EQ(table.admit({{keyOf(1), 0x01}}).refused, 0u);
  EXPECT_EQ(table.admit({{keyOf(1), 0x03}}).refused, 0u);
  expectConsistent(table);
}

/// Arrays are released at once. The block is kept until a mesh update has reported that it is
/// empty.
TEST(BlockTable, AVacatedBlockStaysUntilItIsReleased) {
  BlockTable table(kPlenty);
  table.admit({{keyOf(1), 0x23}, {keyOf(2), 0x01}});
  const int32_t slot = table.find(keyOf(1));
  table.vacate(slot, 0x21);
  EXPECT_EQ(table.arraysInUse(), 2u);
  EXPECT_TRUE(table.takeVacant().empty()) << "a block with an array should not be reported";
  table.vacate(slot, 0x02);
  EXPECT_EQ(table.arraysInUse(), 1u);
  EXPECT_EQ(table.find(keyOf(1)), slot);
  EXPECT_EQ(table.takeVacant(), std::vector<int32_t>{slot});
  EXPECT_TRUE(table.takeVacant().empty()) << "a vacated block should be reported only once";
  EXPECT_EQ(table.releaseVacant({slot}), std::vector<int32_t>{slot});
  EXPECT_EQ(table.find(keyOf(1)), -1);
  EXPECT_EQ(table.bytesInUse(), kBlock + kArray);
  expectConsistent(table);
}

TEST(BlockTable, VacatingUnderRandomLoadLosesNothing) {
  std::mt19937 random(26);
  BlockTable table(50 * (kBlock + 2 * kArray));
  for (int round = 0; round < 200; ++round) {
    const std::vector<int32_t> vacant = table.takeVacant();
    table.admit(randomRequests(random, 10));
    for (const int32_t slot : table.sortedSlots()) {
      if (random() % 3 == 0) table.vacate(slot, random() % 64);
    }
    for (const int32_t slot : table.releaseVacant(vacant)) {
      EXPECT_FALSE(table.block(slot).in_use);
    }
    expectConsistent(table);
  }
  for (const int32_t slot : table.sortedSlots()) table.vacate(slot, 0x3f);
  table.releaseVacant(table.takeVacant());
  EXPECT_EQ(table.bytesInUse(), 0u);
}

/// A vacated block that was never extracted can be released at once. Other vacated blocks are kept
/// until a mesh update.
TEST(BlockTable, DistinguishesUnmeshedVacantBlocks) {
  BlockTable table(kPlenty);
  table.admit({{keyOf(1), 0x01}});
  table.noteExtraction();
  table.admit({{keyOf(2), 0x01}});
  const int32_t seen = table.find(keyOf(1)), unseen = table.find(keyOf(2));
  EXPECT_TRUE(table.vacate(seen, 0x01));
  EXPECT_TRUE(table.vacate(unseen, 0x01));
  EXPECT_EQ(table.takeUnmeshed(), std::vector<int32_t>{unseen});
  EXPECT_EQ(table.releaseVacant({unseen}), std::vector<int32_t>{unseen});
  EXPECT_TRUE(table.takeUnmeshed().empty());
  EXPECT_EQ(table.takeVacant(), std::vector<int32_t>{seen});
}

/// An extraction includes blocks that were emptied and refilled before. If such a block is emptied
/// again during the extraction, it is kept until the next extraction.
TEST(BlockTable, RefilledBlocksAreReportedVacantAgain) {
  BlockTable table(kPlenty);
  table.admit({{keyOf(1), 0x01}});
  table.noteExtraction();
  const int32_t slot = table.find(keyOf(1));
  table.vacate(slot, 0x01);
  table.admit({{keyOf(1), 0x01}});
  table.noteExtraction();
  const std::vector<int32_t> vacant = table.takeVacant();
  table.vacate(slot, 0x01);
  EXPECT_TRUE(table.releaseVacant(vacant).empty());
  EXPECT_EQ(table.takeVacant(), std::vector<int32_t>{slot});
}

TEST(BlockTable, FindsBlocksBeyondABall) {
  BlockTable table(kPlenty);
  // The first six blocks are 0, 4, 12, 20, 12 and 12 sqrt(2) voxels away from (4, 4, 4).
  table.admit({{keyOf(0), 1},
               {keyOf(1), 1},
               {keyOf(2), 1},
               {keyOf(3), 1},
               {keyOf(-2), 1},
               {keyOf(2, 2), 1},
               {keyOf(9), 1}});
  table.vacate(table.find(keyOf(9)), 1);  // has no arrays left, so it does not count
  const auto slots = [&](const std::vector<PackedKey>& keys) {
    std::vector<int32_t> found;
    for (const PackedKey key : keys) found.push_back(table.find(key));
    std::sort(found.begin(), found.end());
    return found;
  };
  const auto beyond = [&](double radius) {
    RegionView ball = {};
    ball.center = {4.0, 4.0, 4.0};
    ball.radius = radius;
    std::vector<int32_t> found = table.slotsBeyond(ball);
    std::sort(found.begin(), found.end());
    return found;
  };
  EXPECT_EQ(beyond(11.9), slots({keyOf(3), keyOf(2, 2), keyOf(-2), keyOf(2)}));
  EXPECT_EQ(beyond(12.0), slots({keyOf(3), keyOf(2, 2)}));
}

/// Memory for the pools is allocated in advance, so the sizes returned by sizesAfter() must
/// suffice.
TEST(BlockTable, PoolsStayWithinThePredictedSizes) {
  std::mt19937 random(25);
  for (const size_t budget : {kPlenty, 40 * BlockTable::kArrayBytes}) {
    BlockTable table(budget);
    for (int round = 0; round < 50; ++round) {
      const std::vector<BlockRequest> requests = randomRequests(random, 10);
      const PoolSizes added = table.countNew(requests);
      const PoolSizes sizes = table.sizesAfter(added.slots, added.arrays);
      const Admission admission = table.admit(requests);
      EXPECT_LE(table.slotCount(), sizes.slots);
      EXPECT_LE(table.arrayCount(), sizes.arrays);
      for (const int32_t slot : admission.changed_slots) {
        if (slot % 3 == 0) table.release(slot, 0x3f);
      }
    }
  }
}

/// The bit in a ColourRequest for brick `number % 8` in direction `number / 8`.
constexpr uint64_t brick(int number) { return uint64_t{1} << number; }

TEST(BlockTableColours, AreReleasedWithTheirVoxels) {
  BlockTable table(kPlenty);
  table.admit({{keyOf(1), 3}, {keyOf(2), 1}});
  const Admission admission =
      table.admitColours({{keyOf(2), brick(5)}, {keyOf(1), brick(0) | brick(7)}});
  const BlockEntry first = table.block(table.find(keyOf(1)));
  const BlockEntry second = table.block(table.find(keyOf(2)));
  ASSERT_EQ(admission.bricks.size(), 3u);
  EXPECT_EQ(admission.bricks[1].array, first.array[0]);
  EXPECT_EQ(admission.bricks[1].brick, 7);
  EXPECT_EQ(admission.bricks[1].colours, 1);
  EXPECT_EQ(admission.bricks[2].array, second.array[0]);
  EXPECT_EQ(table.colourOf(first.array[0], 7), 1);
  EXPECT_EQ(table.colourOf(first.array[0], 1), kNoArray);
  EXPECT_EQ(table.colourOf(first.array[1], 0), kNoArray);
  EXPECT_EQ(table.bytesInUse(), 2 * kBlock + 3 * kArray + 3 * BlockTable::kColourBytes);
  EXPECT_TRUE(table.admitColours({{keyOf(1), brick(7)}, {keyOf(3), ~0ull >> 16}}).bricks.empty());
  EXPECT_EQ(table.admitColours({{keyOf(1), brick(8 + 2)}}).bricks[0].array, first.array[1]);

  table.vacate(table.find(keyOf(1)), 1);
  EXPECT_EQ(table.coloursInUse(), 2u);
  const int32_t again = table.admit({{keyOf(4), 1}}).new_arrays[0];
  EXPECT_EQ(again, first.array[0]);  // reused, without colours
  for (int i = 0; i < kBricksPerArray; ++i) EXPECT_EQ(table.colourOf(again, i), kNoArray);
  EXPECT_LT(table.admitColours({{keyOf(4), brick(3)}}).bricks[0].colours, 2);
  EXPECT_EQ(table.colourCount(), 4u);
  table.clear();
  EXPECT_EQ(table.coloursInUse(), 0u);
  EXPECT_EQ(table.bytesInUse(), 0u);
}

TEST(BlockTableColours, StayWithinTheBudget) {
  BlockTable table(3 * (kBlock + kArray) + 2 * BlockTable::kColourBytes);
  table.admit({{keyOf(1), 1}, {keyOf(2), 1}, {keyOf(3), 1}});
  const std::vector<ColourRequest> requests{
      {keyOf(3), brick(0)}, {keyOf(1), brick(0)}, {keyOf(2), brick(0)}};
  EXPECT_EQ(table.countNewColours(requests), 3u);
  const Admission admission = table.admitColours(requests);
  EXPECT_EQ(admission.bricks.size(), 2u);
  EXPECT_EQ(admission.refused, 1u);
  EXPECT_EQ(table.colourOf(table.block(table.find(keyOf(3))).array[0], 0), kNoArray);
  EXPECT_EQ(table.admit({{keyOf(4), 1}}).refused, 1u);
}

}  // namespace
}  // namespace dtsdf
