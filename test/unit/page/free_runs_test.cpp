// Tests the allocation of runs of consecutive units in a file. No unit is allocated twice, and
// freed runs are reused.
#include "page/free_runs.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace dtsdf {
namespace {

TEST(FreeRuns, MergesAdjacentFreeRuns) {
  FreeRuns runs(30);
  for (uint64_t i = 0; i < 3; ++i) EXPECT_EQ(runs.take(10), 10 * i);
  EXPECT_FALSE(runs.take(1)) << "nothing should be allocated in a full file";
  runs.give(0, 10);
  runs.give(10, 10);
  EXPECT_EQ(runs.take(20), 0u);
  runs.give(20, 10);
  EXPECT_EQ(runs.take(10), 20u);
  runs.give(20, 10);
  runs.give(0, 20);
  EXPECT_EQ(runs.inUse(), 0u);
}

TEST(FreeRuns, NeverAllocatesAUnitTwice) {
  FreeRuns runs(600);
  std::map<uint64_t, uint64_t> taken;
  std::mt19937 random(7);
  size_t refused = 0;
  for (int i = 0; i < 20000; ++i) {
    if (random() % 5 < 2 && !taken.empty()) {
      auto run = taken.begin();
      std::advance(run, random() % taken.size());
      runs.give(run->first, run->second);
      taken.erase(run);
      continue;
    }
    const uint64_t units = 1 + random() % 40;
    const auto first = runs.take(units);
    if (!first) {
      ++refused;
      continue;
    }
    const auto next = taken.lower_bound(*first);
    ASSERT_TRUE(next == taken.end() || *first + units <= next->first);
    if (next != taken.begin()) {
      const auto before = std::prev(next);
      ASSERT_LE(before->first + before->second, *first);
    }
    taken.emplace(*first, units);
  }
  EXPECT_GT(taken.size(), 10u);
  EXPECT_GT(refused, 0u) << "the file should be full at times";
  for (const auto& [first, units] : taken) runs.give(first, units);
  EXPECT_EQ(runs.inUse(), 0u);
  EXPECT_EQ(runs.take(600), 0u) << "all free runs should be merged";
}

}  // namespace
}  // namespace dtsdf
