#include "map/sort_by_key.h"

#include <gtest/gtest.h>

#include <random>

namespace dtsdf {
namespace {

struct Record {
  PackedKey key;
  size_t number;  ///< Position in the input.
};

bool operator==(const Record& a, const Record& b) { return a.key == b.key && a.number == b.number; }

std::vector<Record> randomRecords(size_t count, const BlockKey& from, int32_t side) {
  std::mt19937 random(static_cast<unsigned>(count) + static_cast<unsigned>(side));
  std::uniform_int_distribution<int32_t> offset(0, side);
  std::vector<Record> records;
  for (size_t i = 0; i < count; ++i) {
    const Vec3i at{offset(random), offset(random), offset(random)};
    records.push_back({packKey(from + at), i});
  }
  return records;
}

void expectSorted(std::vector<Record> records) {
  std::vector<Record> truth = records;
  std::stable_sort(truth.begin(), truth.end(),
                   [](const Record& a, const Record& b) { return a.key < b.key; });
  sortByKey(records);
  EXPECT_EQ(records, truth);
}

TEST(SortByKey, SortsFewAndManyRecords) {
  for (const size_t count : {0, 1, 2, 127, 128, 129, 5000}) {
    SCOPED_TRACE(count);
    expectSorted(randomRecords(count, {-20, -3, 700}, 40));
    expectSorted(randomRecords(count, {-1, -1, -1}, 2));  // equal keys keep their order
  }
}

TEST(SortByKey, SortsKeyRangesOfAnyWidth) {
  constexpr int32_t kMin = -kMaxBlockCoordinate;
  for (int32_t side = 1; side <= 2 * kMaxBlockCoordinate; side = 2 * side + 1) {
    SCOPED_TRACE(side);
    expectSorted(randomRecords(1000, {kMin, kMin, kMin}, side));
  }
}

}  // namespace
}  // namespace dtsdf
