#include <gtest/gtest.h>

#include <vector>

#include "evaluation/parallel.h"

namespace dtsdf {
namespace {

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
