#include <gtest/gtest.h>

#include <chrono>
#include <numeric>
#include <thread>
#include <vector>

#include "evaluation/parallel.h"

namespace dtsdf {
namespace {

/// What was merged, in its order.
struct Trace {
  std::vector<size_t> indices;

  void merge(const Trace& other) {
    indices.insert(indices.end(), other.indices.begin(), other.indices.end());
  }
};

/// The last chunk is a part of one, and early chunks are ready last.
TEST(SumOverChunks, AddsChunksInTheirOrder) {
  constexpr size_t kCount = 101;
  const Trace sum = sumOverChunks(kCount, 10, Trace(), [](size_t begin, size_t end, Trace& part) {
    if (begin == 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    for (size_t i = begin; i < end; ++i) part.indices.push_back(i);
  });
  std::vector<size_t> expected(kCount);
  std::iota(expected.begin(), expected.end(), size_t{0});
  EXPECT_EQ(sum.indices, expected);
}

TEST(ForEachIndex, CoversAllOnceAndReportsProgress) {
  std::vector<int> visits(10001, 0);
  size_t last = 0;
  forEachIndex(
      visits.size(), [&](size_t i) { ++visits[i]; }, [&](size_t done) { last = done; });
  EXPECT_EQ(visits, std::vector<int>(10001, 1));
  EXPECT_EQ(last, visits.size());
}

}  // namespace
}  // namespace dtsdf
