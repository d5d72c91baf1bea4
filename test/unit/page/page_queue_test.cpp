// Records on their way to a file and back: none is lost, and no more memory is held than allowed.
#include "page/page_queue.h"

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <thread>

#include "support/temporary_folder.h"

namespace {

/// Files are cut slowly while this is set; how many cuts have begun.
std::atomic<bool> cuts_slowly{false};
std::atomic<int> cuts{0};

}  // namespace

// In place of the system's, for this program.
extern "C" int ftruncate(int file, off_t bytes) noexcept {
  ++cuts;
  if (cuts_slowly) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return static_cast<int>(syscall(SYS_ftruncate, file, bytes));
}

namespace dtsdf {
namespace {

constexpr size_t kRecord = 4096;

SharedRecords filled(size_t records, char byte) {
  SharedRecords bytes = makePlainRecords(records * kRecord);
  std::memset(bytes->data(), byte, bytes->size());
  return bytes;
}

/// Counts the memory that is held.
class CountedRecords : public PlainRecords {
 public:
  explicit CountedRecords(size_t bytes) : PlainRecords(PlainArray<char>(bytes)) { held += size(); }
  ~CountedRecords() override { held -= size(); }
  static std::atomic<size_t> held;
};
std::atomic<size_t> CountedRecords::held{0};

class PageQueueTest : public testing::Test {
 protected:
  static constexpr size_t kMostBytes = size_t{4} << 20;

  std::vector<PageSpan> spans(size_t first, size_t count) {
    std::vector<PageSpan> some;
    for (size_t i = first; i < first + count; ++i) {
      some.push_back({i * kRecord, kRecord, &checksums_[i]});
    }
    return some;
  }
  void forget(size_t first, size_t count) {
    queue_.forget(count, [&](size_t i) { return (first + i) * kRecord; });
  }

  TemporaryFolder folder_;
  std::vector<uint64_t> checksums_ = std::vector<uint64_t>(20000);
  PageFile file_{folder_.path()};
  PageQueue queue_{file_, kMostBytes};
};

/// The end of the file falls twice while it is cut, and rises again.
TEST_F(PageQueueTest, CutsTheFileBeforeItWritesWhatTakesThatPlace) {
  ASSERT_EQ(queue_.write(spans(0, 3), filled(3, 'a')), "");
  queue_.finish();
  cuts_slowly = true;
  const int before = cuts;
  forget(2, 1);
  queue_.shrink(2 * kRecord);
  while (cuts == before) std::this_thread::yield();
  forget(1, 1);
  queue_.shrink(kRecord);
  ASSERT_EQ(queue_.write(spans(1, 1), filled(1, 'b')), "");
  queue_.finish();
  cuts_slowly = false;
  char record[kRecord] = {};
  bool is_short = false;
  EXPECT_EQ(file_.read(kRecord, record, kRecord, is_short), "");
  EXPECT_EQ(record[0], 'b');
}

/// What is read at once shares memory, which a single record keeps.
TEST_F(PageQueueTest, HoldsNoMoreMemoryThanAllowedForWhatNobodyTook) {
  constexpr size_t kAtOnce = 200, kTimes = 50;
  for (size_t k = 0; k < kTimes; ++k) {
    ASSERT_EQ(queue_.write(spans(k * kAtOnce, kAtOnce), filled(kAtOnce, 'x')), "");
  }
  queue_.finish();
  for (size_t k = 0; k < kTimes; ++k) {
    queue_.readAhead(spans(k * kAtOnce, kAtOnce), [](size_t bytes) -> SharedRecords {
      return std::make_shared<CountedRecords>(bytes);
    });
    queue_.finish();
    forget(k * kAtOnce, kAtOnce - 2);
    EXPECT_EQ(queue_.bytes(), CountedRecords::held) << k;
    ASSERT_LE(queue_.bytes(), kMostBytes) << k;
  }
  EXPECT_GT(queue_.bytes(), 0u);
}

}  // namespace
}  // namespace dtsdf
