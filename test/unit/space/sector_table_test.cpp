// Tests that sectors on disk stay intact if reads fail temporarily.
#include "space/sector_table.h"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "space/cell_sector.h"
#include "support/temporary_folder.h"

namespace {

/// How many of the next reads fail.
thread_local int reads_to_fail = 0;

}  // namespace

extern "C" ssize_t pread(int file, void* bytes, size_t size, off_t offset) {
  if (reads_to_fail == 0) return syscall(SYS_pread64, file, bytes, size, offset);
  --reads_to_fail;
  errno = EIO;
  return -1;
}

namespace dtsdf {
namespace {

constexpr PackedKey kSectors = 20;

class SectorTableTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  SharedPagedValues pages_ = std::make_shared<PagedValues>(folder_.path(), size_t{64} << 20, 1);
  SectorTable<CellSector> table_{pages_};

  void SetUp() override {
    for (PackedKey key = 0; key < kSectors; ++key) {
      table_.open(key).make(static_cast<int>(key)).surface = kAllCells;
    }
    table_.close();
    waitUntilWritten();
  }
  void waitUntilWritten() const {
    for (int i = 0; i < 5000 && pages_->bytes() > 1; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_LE(pages_->bytes(), 1u) << "all sectors should be on disk";
  }
  void expectAll() const {
    for (PackedKey key = 0; key < kSectors; ++key) {
      const std::shared_ptr<const CellSector> sector = table_.find(key);
      ASSERT_NE(sector, nullptr) << key;
      ASSERT_FALSE(isEmpty(sector->at(static_cast<int>(key))));
    }
    EXPECT_EQ(pages_->stats().lost, 0u);
  }
};

TEST_F(SectorTableTest, RetriesFailedReads) {
  for (PackedKey key = 0; key < kSectors; ++key) {
    reads_to_fail = 2;
    table_.open(key);
    EXPECT_EQ(reads_to_fail, 0) << "all simulated read failures should occur";
  }
  table_.close();
  expectAll();
}

TEST_F(SectorTableTest, ReportsLostSectors) {
  reads_to_fail = 1000;
  EXPECT_TRUE(table_.open(3).isLost());
  reads_to_fail = 0;
  EXPECT_EQ(pages_->stats().lost, 1u);
}

}  // namespace
}  // namespace dtsdf
