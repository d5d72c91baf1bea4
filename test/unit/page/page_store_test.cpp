// Blocks in a file: they come back as they were, or it is said that they do not.
#include "page/page_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <new>
#include <random>

#include "support/failing_allocations.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

PagedBlock makeBlock(int32_t x, int arrays, int bricks, bool has_labels) {
  return {packKey({x, -x, 3}),
          (uint64_t{1} << bricks) - 1,
          5,
          static_cast<uint8_t>((1u << arrays) - 1u),
          has_labels,
          true,
          false,
          true};
}

PageBytes randomRecords(const std::vector<PagedBlock>& blocks, unsigned seed) {
  size_t bytes = 0;
  for (const PagedBlock& block : blocks) bytes += recordBytes(block);
  PageBytes records(bytes);
  std::mt19937 random(seed);
  std::generate_n(records.data(), bytes, [&] { return static_cast<char>(random()); });
  return records;
}

SharedRecords copyOfRecords(const PageBytes& records) {
  SharedRecords copy = makePlainRecords(records.size());
  std::copy_n(records.data(), records.size(), copy->data());
  return copy;
}

std::vector<PagedBlock> someBlocks(int32_t first, int32_t count) {
  std::vector<PagedBlock> blocks;
  for (int32_t i = first; i < first + count; ++i) {
    blocks.push_back(makeBlock(i, 1 + i % 6, i % 5, i % 3 == 0));
  }
  return blocks;
}

/// The file of this process in a folder, which has no name there: by its descriptor.
std::string openFileIn(const std::string& folder) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code error;
    const std::string target = std::filesystem::read_symlink(entry.path(), error).string();
    if (!error && target.rfind(folder, 0) == 0) return entry.path().string();
  }
  return "";
}

class PageStoreTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  PageStore store_{folder_.path(), 64 << 20, 1 << 20};

  std::vector<int32_t> numbersOf(const std::vector<PagedBlock>& blocks) {
    std::vector<int32_t> numbers;
    for (const PagedBlock& block : blocks) numbers.push_back(store_.find(block.key));
    return numbers;
  }
  /// Whether write() says so where this allocation fails; if all succeed or the index lacks the
  /// memory, it does not.
  bool isRefused(const std::vector<PagedBlock>& blocks, const SharedRecords& records,
                 int allocation) {
    allocations_left = allocation;
    bool is_refused = false;
    try {
      is_refused = !store_.write(blocks, records);
    } catch (const std::bad_alloc&) {
    }
    allocations_left = -1;
    return is_refused;
  }
  void expectHolds(const std::vector<PagedBlock>& blocks, const PageBytes& records) {
    PageBytes read;
    const std::vector<uint8_t> intact = store_.read(numbersOf(blocks), read);
    EXPECT_EQ(intact, std::vector<uint8_t>(blocks.size(), 1));
    ASSERT_EQ(read.size(), records.size());
    EXPECT_EQ(std::memcmp(read.data(), records.data(), read.size()), 0);
  }
};

TEST_F(PageStoreTest, GivesBackWhatWasWritten) {
  const std::vector<PagedBlock> first = someBlocks(0, 50), second = someBlocks(50, 70);
  const PageBytes first_records = randomRecords(first, 1),
                  second_records = randomRecords(second, 2);
  ASSERT_TRUE(store_.write(first, copyOfRecords(first_records)));
  ASSERT_TRUE(store_.write(second, copyOfRecords(second_records)));
  EXPECT_EQ(store_.count(), 120u);
  EXPECT_EQ(store_.bytes(), first_records.size() + second_records.size());
  expectHolds(second, second_records);
  expectHolds(first, first_records);
  const PagedBlock& block = store_.block(store_.find(first[7].key));
  EXPECT_EQ(block.bricks, first[7].bricks);
  EXPECT_EQ(block.directions, first[7].directions);
  EXPECT_EQ(block.extractions, 5u);
  EXPECT_TRUE(block.dirty && !block.painted && block.has_mesh);
  EXPECT_EQ(store_.find(packKey({1000, 0, 0})), -1);
}

TEST_F(PageStoreTest, UsesSpaceAgain) {
  const std::vector<PagedBlock> first = someBlocks(0, 60), second = someBlocks(60, 60);
  const PageBytes first_records = randomRecords(first, 1);
  ASSERT_TRUE(store_.write(first, copyOfRecords(first_records)));
  const uint64_t bytes = store_.bytes();
  for (unsigned i = 0; i < 20; ++i) {
    const PageBytes records = randomRecords(second, i);
    ASSERT_TRUE(store_.write(second, copyOfRecords(records)));
    expectHolds(second, records);
    store_.release(numbersOf(second));
    EXPECT_EQ(store_.bytes(), bytes);
  }
  expectHolds(first, first_records);
  const std::string file = openFileIn(folder_.path());
  ASSERT_NE(file, "");
  store_.finish();
  EXPECT_LE(std::filesystem::file_size(file), bytes);
  store_.clear();
  EXPECT_TRUE(store_.isEmpty());
  store_.finish();
  EXPECT_EQ(std::filesystem::file_size(file), 0u);
}

/// One that is damaged does not take others with it.
TEST_F(PageStoreTest, FindsDamage) {
  const std::vector<PagedBlock> blocks = someBlocks(0, 30);
  const PageBytes records = randomRecords(blocks, 3);
  ASSERT_TRUE(store_.write(blocks, copyOfRecords(records)));
  store_.finish();
  const std::string file = openFileIn(folder_.path());
  ASSERT_NE(file, "");
  {
    std::fstream damaged(file, std::ios::in | std::ios::out | std::ios::binary);
    damaged.seekp(static_cast<std::streamoff>(recordBytes(blocks[0]) + 100));
    damaged.put(static_cast<char>(records[recordBytes(blocks[0]) + 100] ^ 1));
  }
  PageBytes read;
  std::vector<uint8_t> intact = store_.read(numbersOf(blocks), read);
  EXPECT_EQ(intact[1], 0);
  intact[1] = 1;
  EXPECT_EQ(intact, std::vector<uint8_t>(blocks.size(), 1));
  EXPECT_NE(store_.problem().find("damaged"), std::string::npos) << store_.problem();
  std::filesystem::resize_file(file, 1000);
  EXPECT_EQ(store_.read(numbersOf(blocks), read), std::vector<uint8_t>(blocks.size(), 0));
  EXPECT_NE(store_.problem().find("shorter"), std::string::npos) << store_.problem();
}

TEST_F(PageStoreTest, IsFullAtItsLimit) {
  PageStore store(folder_.path(), 400 << 10, 1 << 20);
  const std::vector<PagedBlock> blocks = someBlocks(0, 12), more = someBlocks(12, 40);
  ASSERT_TRUE(store.write(blocks, copyOfRecords(randomRecords(blocks, 1))));
  EXPECT_TRUE(store.hasRoomFor((400 << 10) - store.bytes(), true));
  EXPECT_FALSE(store.hasRoomFor((400 << 10) - store.bytes(), false)) << "that is the reserve";
  EXPECT_TRUE(store.isFull(false));
  EXPECT_FALSE(store.isFull(true));
  EXPECT_NE(store.problem().find("map/page_max_gb"), std::string::npos) << store.problem();
  const uint64_t bytes = store.bytes();
  EXPECT_FALSE(store.write(more, copyOfRecords(randomRecords(more, 1))));
  EXPECT_NE(store.problem().find("map/page_max_gb"), std::string::npos) << store.problem();
  EXPECT_EQ(store.bytes(), bytes) << "nothing has changed";
  EXPECT_EQ(store.count(), blocks.size());
  store.release({store.find(blocks[0].key)});
  EXPECT_FALSE(store.isFull(false)) << "now it may be tried again";
}

/// A disk without space, as a limit of the process makes one. What was taken before it was known
/// stays in memory until it can be written.
TEST_F(PageStoreTest, SurvivesADiskThatRefuses) {
  const std::vector<PagedBlock> blocks = someBlocks(0, 12), second = someBlocks(12, 40),
                                third = someBlocks(52, 9);
  const PageBytes records = randomRecords(blocks, 1), second_records = randomRecords(second, 2),
                  third_records = randomRecords(third, 3);
  ASSERT_TRUE(store_.write(blocks, copyOfRecords(records)));
  store_.finish();
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{records.size() + 5000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_TRUE(store_.write(second, copyOfRecords(second_records))) << "nobody knows yet";
  store_.finish();
  const bool written = store_.write(third, copyOfRecords(third_records));
  const std::string problem = store_.problem();
  expectHolds(second, second_records);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_FALSE(written);
  EXPECT_NE(problem.find("cannot write"), std::string::npos) << problem;
  EXPECT_EQ(store_.count(), blocks.size() + second.size());
  expectHolds(blocks, records);
  ASSERT_TRUE(store_.write(third, copyOfRecords(third_records))) << "later there is space again";
  store_.finish();
  EXPECT_EQ(std::filesystem::file_size(openFileIn(folder_.path())), store_.bytes());
  expectHolds(second, second_records);
  expectHolds(third, third_records);
}

/// They are there when they are needed, though the file is gone by then.
TEST_F(PageStoreTest, ReadsAhead) {
  const std::vector<PagedBlock> blocks = someBlocks(0, 30);
  const PageBytes records = randomRecords(blocks, 4);
  ASSERT_TRUE(store_.write(blocks, copyOfRecords(records)));
  store_.finish();
  store_.readAhead(numbersOf(blocks));
  store_.finish();
  std::filesystem::resize_file(openFileIn(folder_.path()), 0);
  const uint64_t waits = store_.waits().count;
  expectHolds(blocks, records);
  EXPECT_EQ(store_.waits().count, waits) << "nobody waited for the disk";
  store_.release(numbersOf(blocks));
  const PageBytes others = randomRecords(blocks, 5);
  ASSERT_TRUE(store_.write(blocks, copyOfRecords(others)));
  expectHolds(blocks, others);
}

/// What is in memory is found there, the first ones at least; the rest is read.
TEST_F(PageStoreTest, FetchesWithoutCopies) {
  const std::vector<PagedBlock> blocks = someBlocks(0, 30);
  const PageBytes records = randomRecords(blocks, 4);
  const SharedRecords written = copyOfRecords(records);
  ASSERT_TRUE(store_.write(blocks, written));
  store_.finish();
  const std::vector<int32_t> numbers = numbersOf(blocks);
  EXPECT_EQ(store_.countInMemory(numbers), 0u);
  store_.readAhead({numbers.begin(), numbers.begin() + 12});
  store_.finish();
  EXPECT_EQ(store_.countInMemory(numbers), 12u);
  int made = 0;
  const RecordsMaker make = [&made](size_t bytes) {
    ++made;
    return makePlainRecords(bytes);
  };
  std::vector<RecordPlace> places;
  EXPECT_EQ(store_.fetch(numbers, make, places), std::vector<uint8_t>(30, kPageIntact));
  EXPECT_EQ(made, 1) << "for those that were not in memory";
  const char* record = records.data();
  for (size_t i = 0; i < blocks.size(); ++i) {
    const size_t bytes = recordBytes(blocks[i]);
    EXPECT_EQ(std::memcmp(places[i].data(), record, bytes), 0) << i;
    record += bytes;
  }
}

/// One that is asked for twice takes memory once.
TEST_F(PageStoreTest, ReadsAheadOnce) {
  const std::vector<PagedBlock> blocks = someBlocks(0, 20);
  const PageBytes records = randomRecords(blocks, 4);
  ASSERT_LT(2 * records.size(), size_t{1} << 20) << "else there is no room for it twice";
  ASSERT_TRUE(store_.write(blocks, copyOfRecords(records)));
  store_.finish();
  EXPECT_EQ(store_.queueBytes(), 0u);
  std::vector<int32_t> twice = numbersOf(blocks);
  twice.insert(twice.end(), twice.begin(), twice.end());
  for (int i = 0; i < 50; ++i) {
    store_.readAhead(twice);  // some of it while others are read
    if (i % 2 == 0) store_.finish();
  }
  store_.finish();
  EXPECT_EQ(store_.queueBytes(), records.size());
  expectHolds(blocks, records);
  store_.release(numbersOf(blocks));
  EXPECT_EQ(store_.queueBytes(), 0u);
}

/// Whichever allocation of a call of write() fails, those of the index too, nothing has changed.
TEST_F(PageStoreTest, OutlivesALackOfMemory) {
  const std::vector<PagedBlock> first = someBlocks(0, 5), more = someBlocks(5, 90);
  const PageBytes records = randomRecords(first, 1), more_records = randomRecords(more, 2);
  ASSERT_TRUE(store_.write(first, copyOfRecords(records)));
  store_.finish();
  const uint64_t bytes = store_.bytes();
  int refused = 0;
  while (isRefused(more, copyOfRecords(more_records), refused)) {
    ++refused;
    ASSERT_EQ(store_.problem(), "out of memory");
    ASSERT_EQ(store_.bytes(), bytes);
    ASSERT_EQ(store_.count(), first.size());
    store_.finish();
    ASSERT_EQ(store_.queueBytes(), 0u);
  }
  EXPECT_GT(refused, 90) << "one for each record at least";
  expectHolds(first, records);
  expectHolds(more, more_records);
  for (const PagedBlock& block : more)
    EXPECT_EQ(store_.block(store_.find(block.key)).key, block.key);
  size_t in_cells = 0;
  store_.visit([&](int32_t, const PagedBlock&) { ++in_cells; });
  EXPECT_EQ(in_cells, first.size() + more.size());
}

/// Nor does it take memory to let blocks go: where there is none, their place in the file is lost
/// until the store is emptied.
TEST_F(PageStoreTest, LetsGoWithoutMemory) {
  const std::vector<PagedBlock> blocks = someBlocks(0, 60);
  const PageBytes records = randomRecords(blocks, 1);
  ASSERT_TRUE(store_.write(blocks, copyOfRecords(records)));
  std::vector<PagedBlock> some;
  for (size_t i = 1; i < blocks.size(); i += 2) some.push_back(blocks[i]);
  const std::vector<int32_t> numbers = numbersOf(some);
  allocations_left = 0;
  store_.release(numbers);
  allocations_left = -1;
  EXPECT_EQ(store_.count(), 30u);
  for (const PagedBlock& block : some) EXPECT_EQ(store_.find(block.key), -1);
  ASSERT_TRUE(store_.write(some, copyOfRecords(randomRecords(some, 2))));
  expectHolds(some, randomRecords(some, 2));
  EXPECT_TRUE(store_.marked() == blocks.size());
  store_.clear();
  EXPECT_EQ(store_.bytes(), 0u);
  EXPECT_EQ(store_.marked(), 0u);
}

/// Blocks come and go while they are written and read: whatever the thread has reached, they are
/// what they were.
TEST_F(PageStoreTest, GivesBackWhatIsOnItsWay) {
  std::mt19937 random(7);
  std::vector<PageBytes> records(12);
  std::vector<std::vector<PagedBlock>> groups;
  for (int32_t i = 0; i < 12; ++i) groups.push_back(someBlocks(100 * i, 5 + 3 * i));
  for (unsigned turn = 0; turn < 1000; ++turn) {
    const size_t i = random() % groups.size();
    if (records[i].size() == 0) {
      records[i] = randomRecords(groups[i], turn);
      ASSERT_TRUE(store_.write(groups[i], copyOfRecords(records[i])));
    } else if (random() % 3 == 0) {
      store_.readAhead(numbersOf(groups[i]));
    } else {
      ASSERT_NO_FATAL_FAILURE(expectHolds(groups[i], records[i]));
      store_.release(numbersOf(groups[i]));
      records[i] = PageBytes();
    }
  }
}

/// Not even of a process that is killed while it writes; and the next one finds nothing in its way.
TEST(PageStoreKilled, LeavesNothingBehind) {
  const TemporaryFolder folder;
  int to_parent[2];
  ASSERT_EQ(pipe(to_parent), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    PageStore store(folder.path(), 64 << 20, 1 << 20);
    for (unsigned i = 0;; ++i) {
      const std::vector<PagedBlock> blocks = someBlocks(static_cast<int32_t>(10 * i), 10);
      const bool is_written = store.write(blocks, copyOfRecords(randomRecords(blocks, i)));
      if (i == 20 && write(to_parent[1], "x", 1) != 1) _exit(1);
      if (!is_written) store.clear();
    }
  }
  char byte;
  ASSERT_EQ(read(to_parent[0], &byte, 1), 1);
  kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(folder.entryCount(), 0u);
  PageStore store(folder.path(), 64 << 20, 1 << 20);
  const std::vector<PagedBlock> blocks = someBlocks(0, 10);
  EXPECT_TRUE(store.write(blocks, copyOfRecords(randomRecords(blocks, 1))));
  EXPECT_EQ(folder.entryCount(), 0u) << "a store that is used has no file to be removed either";
}

}  // namespace
}  // namespace dtsdf
