#include "meshing/mesh_chunks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "kernels/core/grid.h"

namespace dtsdf {
namespace {

void markChanged(MeshChunks& chunks, const std::vector<BlockKey>& blocks) {
  for (const BlockKey& block : blocks) chunks.markChanged(block);
}

TEST(MeshChunks, ABlockMarksTheChunkThatContainsIt) {
  for (const BlockKey key : {BlockKey{0, 0, 0}, BlockKey{-1, 0, 3}, BlockKey{-4, -5, 4},
                             BlockKey{kMaxBlockCoordinate, -kMaxBlockCoordinate, 7}}) {
    MeshChunks chunks(4);
    chunks.markChanged(key);
    ASSERT_EQ(chunks.changed().size(), 1u);
    const auto blocks = chunks.blocksOf(*chunks.changed().begin());
    EXPECT_EQ(std::count(blocks.begin(), blocks.end(), packKey(key)), 1);
    EXPECT_TRUE(std::is_sorted(blocks.begin(), blocks.end()));
  }
}

TEST(MeshChunks, KeepIdsAndForgetChanges) {
  MeshChunks chunks(4);
  markChanged(chunks, {{0, 0, 0}, {3, 3, 3}, {4, 0, 0}});
  ASSERT_EQ(chunks.all().size(), 2u);
  const PackedKey first = chunks.all()[0];
  const PackedKey second = chunks.all()[1];
  const int id = chunks.idOf(first);
  EXPECT_NE(id, chunks.idOf(second));

  chunks.forgetChanges();
  EXPECT_TRUE(chunks.changed().empty());
  markChanged(chunks, {{-9, -9, -9}, {1, 1, 1}});
  EXPECT_EQ(chunks.changed().size(), 2u);
  EXPECT_EQ(chunks.idOf(first), id);
  chunks.markAllChanged();
  EXPECT_EQ(chunks.changed().size(), 3u);
}

/// An exploring camera adds chunks on both sides of the existing chunks.
TEST(MeshChunks, RoundRobinReachesAllDespiteNewChunks) {
  MeshChunks chunks(1);
  for (int x = 0; x < 10; ++x) chunks.markChanged({x, 0, 0});
  const std::vector<PackedKey> first = chunks.all();
  for (int circle = 0; circle < 10; ++circle) EXPECT_EQ(chunks.nextRoundRobin(10), first);
  std::set<PackedKey> had_turn;
  for (int round = 0; round < 10; ++round) {
    for (const PackedKey chunk : chunks.nextRoundRobin(2)) had_turn.insert(chunk);
    markChanged(chunks, {{-1 - round, 0, 0}, {10 + round, 0, 0}});
  }
  for (const PackedKey chunk : first) EXPECT_EQ(had_turn.count(chunk), 1u);
  EXPECT_EQ(chunks.nextRoundRobin(100), chunks.nextRoundRobin(30));
}

}  // namespace
}  // namespace dtsdf
