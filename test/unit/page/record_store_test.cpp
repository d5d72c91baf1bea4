// Tests that records in a file, and blocks stored as records, are read back unchanged or reported
// as lost.
#include "page/record_store.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "page/paged_blocks.h"
#include "support/page_faults.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

std::vector<char> recordOf(size_t seed) {
  std::mt19937 random(static_cast<unsigned>(seed));
  std::vector<char> record(100 + random() % 20000);
  for (char& byte : record) byte = static_cast<char>(random());
  return record;
}

RecordBytes bytesOf(std::vector<char> record) {
  const auto owner = std::make_shared<std::vector<char>>(std::move(record));
  const size_t half = owner->size() / 2;
  return {owner, {{owner->data(), half}, {owner->data() + half, owner->size() - half}}};
}

class RecordStoreTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  static constexpr size_t kMaxWaiting = size_t{1} << 18;
  RecordStore store_{folder_.path(), size_t{4} << 20, kMaxWaiting};
  std::vector<StoredRecord> records_;

  void write(unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      const auto stored = store_.write(bytesOf(recordOf(i)));
      ASSERT_TRUE(stored);
      records_.push_back(*stored);
    }
  }
  RecordStore::Reading read(unsigned i) {
    std::vector<char> record;
    const RecordStore::Reading reading = store_.read(records_[i], record);
    EXPECT_TRUE(reading != RecordStore::Reading::kIntact || record == recordOf(i));
    return reading;
  }
  void waitUntilWritten() const {
    while (store_.waitingBytes() > 0) std::this_thread::yield();
  }
};

TEST_F(RecordStoreTest, ReadsBackWhatWasWritten) {
  ASSERT_NO_FATAL_FAILURE(write(100));
  for (unsigned i = 100; i-- > 0;) {
    store_.readAhead(records_[i]);
    ASSERT_EQ(read(i), RecordStore::Reading::kIntact);
  }
  EXPECT_EQ(folder_.entryCount(), 0u) << "the page file should not be visible in its folder";
  for (const StoredRecord& record : records_) store_.erase(record);
  EXPECT_EQ(store_.stats().bytes, 0u);
  EXPECT_EQ(lseek(openFilesIn(folder_.path()).front(), 0, SEEK_END), 0);
}

TEST_F(RecordStoreTest, RespectsItsSizeLimit) {
  size_t written = 0;
  for (unsigned i = 0; i < 1000; ++i) {
    const auto stored = store_.write(bytesOf(recordOf(i)));
    if (!stored) break;
    written += stored->bytes;
  }
  EXPECT_GT(written, size_t{3} << 20);
  EXPECT_LE(store_.stats().bytes, size_t{4} << 20);
  EXPECT_NE(store_.stats().problem.find("map/page_max_gb"), std::string::npos);
}

TEST_F(RecordStoreTest, DetectsDamage) {
  ASSERT_NO_FATAL_FAILURE(write(30));
  waitUntilWritten();
  overwritePages(folder_.path());
  EXPECT_EQ(read(3), RecordStore::Reading::kDamaged);
  EXPECT_EQ(store_.stats().lost, 1u);
  EXPECT_EQ(ftruncate(openFilesIn(folder_.path()).front(), 100), 0);
  EXPECT_EQ(read(20), RecordStore::Reading::kDamaged);
}

TEST_F(RecordStoreTest, SurvivesADiskOutage) {
  ASSERT_NO_FATAL_FAILURE(write(30));
  waitUntilWritten();
  size_t taken = 0;
  {
    const DiskOutage outage(folder_.path());
    EXPECT_EQ(read(3), RecordStore::Reading::kUnreadable);
    while (const auto stored = store_.write(bytesOf(recordOf(records_.size())))) {
      records_.push_back(*stored);
      taken += stored->bytes;
      ASSERT_LE(taken, kMaxWaiting);
    }
    EXPECT_GT(records_.size(), 30u) << "records should wait in memory";
    EXPECT_EQ(store_.waitingBytes(), taken);
    EXPECT_GT(store_.stats().failures, 1u);
    EXPECT_EQ(read(30), RecordStore::Reading::kIntact)
        << "a record that waits in memory should be readable";
    store_.erase(records_.back());
    records_.pop_back();
  }
  for (unsigned i = 0; i < records_.size(); ++i) {
    ASSERT_EQ(read(i), RecordStore::Reading::kIntact);
  }
  ASSERT_TRUE(store_.write(bytesOf(recordOf(0))));
  waitUntilWritten();
  for (unsigned i = 0; i < records_.size(); ++i) {
    ASSERT_EQ(read(i), RecordStore::Reading::kIntact);
  }
  EXPECT_EQ(store_.stats().lost, 0u);
}

TEST_F(RecordStoreTest, WritesRecordsThatFitOnAFullDisk) {
  ASSERT_NO_FATAL_FAILURE(write(40));
  waitUntilWritten();
  const int file = openFilesIn(folder_.path()).front();
  for (unsigned i = 0; i < 40; i += 2) store_.erase(records_[i]);
  const std::vector<char> large(25000, 'l'), small(100, 's');
  std::vector<StoredRecord> stored;
  const auto put = [&](const std::vector<char>& record) {
    const auto at = store_.write(bytesOf(record));
    ASSERT_TRUE(at);
    stored.push_back(*at);
  };
  const auto expectAll = [&] {
    for (const StoredRecord& record : stored) {
      std::vector<char> read;
      ASSERT_EQ(store_.read(record, read), RecordStore::Reading::kIntact);
      EXPECT_EQ(read, record.bytes == small.size() ? small : large);
    }
  };
  {
    const FileSizeLimit full(static_cast<rlim_t>(lseek(file, 0, SEEK_END)));
    ASSERT_NO_FATAL_FAILURE(put(large));
    for (int i = 0; i < 50; ++i) ASSERT_NO_FATAL_FAILURE(put(small));
    while (store_.waitingBytes() > large.size()) std::this_thread::yield();
    expectAll();
  }
  ASSERT_NO_FATAL_FAILURE(put(small));
  waitUntilWritten();
  expectAll();
}

/// Two threads read and erase records while the helper thread writes.
TEST_F(RecordStoreTest, CanBeReadAndErasedDuringWrites) {
  for (unsigned round = 0; round < 5; ++round) {
    records_.clear();
    ASSERT_NO_FATAL_FAILURE(write(150));
    std::thread others([this] {
      for (unsigned i = 0; i < 150; i += 2) EXPECT_EQ(read(i), RecordStore::Reading::kIntact);
    });
    for (unsigned i = 1; i < 150; i += 2) {
      EXPECT_EQ(read(i), RecordStore::Reading::kIntact);
      store_.erase(records_[i]);
    }
    others.join();
    for (unsigned i = 0; i < 150; i += 2) store_.erase(records_[i]);
  }
  EXPECT_EQ(store_.stats().bytes, 0u);
  EXPECT_EQ(store_.waitingBytes(), 0u);
}

/// The index lists none of the blocks that the store refused.
TEST_F(RecordStoreTest, StoresPagedBlocks) {
  PagedBlocks blocks(folder_.path(), size_t{1} << 20, kMaxWaiting);
  const auto put = [&](int32_t x) {
    return blocks.put({{{x, 0, 0}, 3, 0}, 7, {{x % 2 == 0, false}, true, false}},
                      bytesOf(recordOf(1)));
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
  blocks.setMarks(number, {});
  EXPECT_EQ(blocks.marked(), static_cast<size_t>((count + 1) / 2 - 1));
  blocks.erase(number);
  EXPECT_EQ(blocks.find(packKey({4, 0, 0})), -1);
  EXPECT_TRUE(put(4));
}

}  // namespace
}  // namespace dtsdf
