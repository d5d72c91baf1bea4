// Tests that values that were written to a file while unused are read back unchanged or reported as
// lost.
#include "page/paged_values.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <random>
#include <thread>

#include "support/page_faults.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

constexpr size_t kMaxBytes = size_t{1} << 20;

struct Value {
  std::vector<uint32_t> words;

  size_t bytes() const { return sizeof(*this) + words.size() * sizeof(uint32_t); }
  template <class Io>
  void visitRecord(Io& io) {
    size_t size = words.size();
    io(size);
    io.array(words, size);
  }
};

std::shared_ptr<const Value> valueOf(uint32_t seed) {
  std::mt19937 random(seed);
  auto value = std::make_shared<Value>();
  value->words.resize(1000 + random() % 20000);
  std::generate(value->words.begin(), value->words.end(), std::ref(random));
  return value;
}

class PagedValuesTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  SharedPagedValues pages_ =
      std::make_shared<PagedValues>(folder_.path(), size_t{64} << 20, kMaxBytes);
  std::vector<Paged<Value>> values_;

  void keep(uint32_t count) {
    for (uint32_t i = 0; i < count; ++i) values_.push_back({valueOf(i), pages_});
  }
  bool isThere(uint32_t i) const {
    const auto value = values_[i].get();
    return value != nullptr && value->words == valueOf(i)->words;
  }
};

TEST_F(PagedValuesTest, AreReadBackUnchanged) {
  keep(300);
  EXPECT_LE(pages_->bytes(), 3 * kMaxBytes) << "most values should not be in memory";
  EXPECT_GT(pages_->stats().bytes, size_t{5} << 20) << "most values should be on disk";
  for (uint32_t i = 0; i < 300; ++i) ASSERT_TRUE(isThere(i)) << i;
  for (uint32_t i = 300; i-- > 0;) ASSERT_TRUE(isThere(i)) << i;
  EXPECT_LE(pages_->bytes(), 3 * kMaxBytes);
  EXPECT_FALSE(pages_->isFull());
  EXPECT_EQ(folder_.entryCount(), 0u) << "the page file should not be visible in its folder";
  values_.clear();
  EXPECT_EQ(pages_->stats().bytes, 0u);
  EXPECT_EQ(pages_->bytes(), 0u);
}

/// Several threads, like planners that query a snapshot, read copies of the values while the values
/// are replaced.
TEST_F(PagedValuesTest, CanBeReadBySeveralThreads) {
  keep(100);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&, t, values = values_] {
      for (uint32_t i = 0; i < 100; ++i) {
        const uint32_t n = (i * 37 + static_cast<uint32_t>(t) * 11) % 100;
        wrong += values[n].get()->words == valueOf(n)->words ? 0 : 1;
      }
    });
  }
  for (uint32_t i = 0; i < 100; ++i) values_[i] = Paged<Value>(valueOf(i + 500), pages_);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(PagedValuesTest, DetectDamage) {
  keep(300);
  while (pages_->bytes() > kMaxBytes) std::this_thread::yield();  // until the rest is on disk
  damagePages(folder_.path(), 60, 40000);
  uint64_t missing = 0;
  for (uint32_t i = 0; i < 300; ++i) {
    if (values_[i].get() == nullptr) {
      ++missing;
    } else {
      ASSERT_TRUE(isThere(i));
    }
  }
  EXPECT_GT(missing, 10u);
  EXPECT_EQ(pages_->stats().lost, missing);
  EXPECT_NE(pages_->stats().problem.find("damaged"), std::string::npos);
}

TEST_F(PagedValuesTest, StayInMemoryWhileTheDiskFails) {
  {
    const FileSizeLimit disk(0);
    keep(200);
    EXPECT_TRUE(pages_->isFull());
    const PagedValues::Stats stats = pages_->stats();
    EXPECT_GT(stats.failures, 0u);
    EXPECT_LT(stats.failures, 40u) << "writing should not be retried for every value";
    EXPECT_NE(stats.problem.find("map/page_folder"), std::string::npos);
    for (uint32_t i = 0; i < 200; ++i) ASSERT_TRUE(isThere(i)) << i;
  }
  keep(400);
  EXPECT_FALSE(pages_->isFull()) << "the disk should be used again";
  EXPECT_EQ(pages_->stats().lost, 0u);
}

}  // namespace
}  // namespace dtsdf
