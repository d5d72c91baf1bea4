// Records in a file, and blocks of a map in such: they come back as they were, or it is said that
// they do not.
#include "page/record_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <random>
#include <string>
#include <vector>

#include "page/paged_blocks.h"
#include "support/page_faults.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

std::string recordOf(unsigned seed) {
  std::mt19937 random(seed);
  std::string record(100 + random() % 20000, '\0');
  for (char& byte : record) byte = static_cast<char>(random());
  return record;
}

class RecordStoreTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  RecordStore store_{folder_.path(), size_t{4} << 20};
  std::vector<StoredRecord> records_;

  void write(unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      const std::string record = recordOf(i);
      const auto stored = store_.write(record.data(), record.size());
      ASSERT_TRUE(stored);
      records_.push_back(*stored);
    }
  }
  RecordStore::Reading read(unsigned i) {
    std::string record(records_[i].bytes, '\0');
    const RecordStore::Reading reading = store_.read(records_[i], record.data());
    EXPECT_TRUE(reading != RecordStore::Reading::kIntact || record == recordOf(i));
    return reading;
  }
};

TEST_F(RecordStoreTest, GivesBackWhatWasWritten) {
  ASSERT_NO_FATAL_FAILURE(write(100));
  for (unsigned i = 100; i-- > 0;) {
    store_.readAhead(records_[i]);
    ASSERT_EQ(read(i), RecordStore::Reading::kIntact);
  }
  EXPECT_EQ(folder_.entryCount(), 0u) << "the file has no name";
  const uint64_t room = store_.room();
  for (const StoredRecord& record : records_) store_.erase(record);
  EXPECT_GT(store_.room(), room);
  EXPECT_EQ(store_.stats().bytes, 0u);
  EXPECT_EQ(lseek(openFilesIn(folder_.path()).front(), 0, SEEK_END), 0) << "its space is back";
}

TEST_F(RecordStoreTest, TakesNoMoreThanItMay) {
  size_t written = 0;
  for (unsigned i = 0; i < 1000; ++i) {
    const std::string record = recordOf(i);
    const auto stored = store_.write(record.data(), record.size());
    if (!stored) break;
    written += record.size();
  }
  EXPECT_GT(written, size_t{3} << 20);
  EXPECT_LE(store_.stats().bytes, size_t{4} << 20);
  EXPECT_NE(store_.stats().problem.find("map/page_max_gb"), std::string::npos);
}

TEST_F(RecordStoreTest, FindsDamage) {
  ASSERT_NO_FATAL_FAILURE(write(30));
  overwritePages(folder_.path());
  EXPECT_EQ(read(3), RecordStore::Reading::kDamaged);
  EXPECT_EQ(store_.stats().lost, 1u);
  EXPECT_EQ(ftruncate(openFilesIn(folder_.path()).front(), 100), 0);
  EXPECT_EQ(read(20), RecordStore::Reading::kDamaged) << "it will not come with another try";
}

TEST_F(RecordStoreTest, WaitsForADiskThatIsAway) {
  ASSERT_NO_FATAL_FAILURE(write(30));
  {
    const DiskOutage outage(folder_.path());
    EXPECT_EQ(read(3), RecordStore::Reading::kUnreadable);
    EXPECT_FALSE(store_.write("abc", 3));
    EXPECT_EQ(store_.stats().failures, 2u);
  }
  EXPECT_EQ(read(3), RecordStore::Reading::kIntact);
  EXPECT_EQ(store_.stats().lost, 0u);
}

/// The index follows: a block that the disk does not take is not there.
TEST_F(RecordStoreTest, HoldsBlocks) {
  PagedBlocks blocks(folder_.path(), size_t{1} << 20);
  const std::string record = recordOf(1);
  const auto put = [&](int32_t x) {
    return blocks.put({{{x, 0, 0}, 3, 0}, 7, x % 2 == 0, false, true, false}, record.data(),
                      record.size());
  };
  int32_t count = 0;
  while (put(count)) ++count;
  EXPECT_GT(count, 10);
  EXPECT_EQ(blocks.count(), static_cast<size_t>(count));
  EXPECT_EQ(blocks.find(packKey({count, 0, 0})), -1);
  EXPECT_EQ(blocks.marked(), static_cast<size_t>((count + 1) / 2));
  const int32_t number = blocks.find(packKey({4, 0, 0}));
  ASSERT_GE(number, 0);
  EXPECT_EQ(blocks.block(number).extractions, 7u);
  blocks.setMarks(number, false, false);
  EXPECT_EQ(blocks.marked(), static_cast<size_t>((count + 1) / 2 - 1));
  blocks.erase(number);
  EXPECT_EQ(blocks.find(packKey({4, 0, 0})), -1);
  EXPECT_TRUE(put(4));
}

}  // namespace
}  // namespace dtsdf
