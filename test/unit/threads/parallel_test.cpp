// Loops over what is small: each number once, by as many threads as there are, and errors.
#include "threads/parallel.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <mutex>
#include <numeric>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace dtsdf {
namespace {

TEST(ParallelFor, VisitsEachNumberOnce) {
  for (const int threads : {1, 2, 3, 7}) {
    for (const size_t count : {0, 1, 2, 8, 9, 100, 1001}) {
      std::vector<int> visits(count, 0);
      parallelFor(count, threads, [&](size_t i) { ++visits[i]; });
      parallelFor<8>(count, threads, [&](size_t i) { ++visits[i]; });
      EXPECT_EQ(visits, std::vector<int>(count, 2)) << threads << " threads";
    }
  }
}

/// Many loops of next to nothing, as a member is called, left and called again.
TEST(ParallelFor, NothingIsLostBetweenLoops) {
  for (size_t loop = 0; loop < 20000; ++loop) {
    int visits[3] = {};
    parallelFor(3, 3, [&](size_t i) { ++visits[i]; });
    ASSERT_EQ(std::accumulate(visits, visits + 3, 0), 3) << loop;
  }
}

TEST(ParallelFor, AThreadHasAScratchOfItsOwn) {
  struct Scratch {
    std::thread::id thread = std::this_thread::get_id();
  };
  std::atomic<int> foreign{0};
  parallelFor<Scratch>(1000, 3, [&](size_t, Scratch& scratch) {
    if (scratch.thread != std::this_thread::get_id()) ++foreign;
  });
  EXPECT_EQ(foreign, 0);
}

/// Each waits until all are in the body.
TEST(ParallelFor, AllThreadsTakePart) {
  std::mutex mutex;
  std::condition_variable changed;
  std::set<std::thread::id> seen;
  parallelFor(3, 3, [&](size_t) {
    std::unique_lock<std::mutex> lock(mutex);
    seen.insert(std::this_thread::get_id());
    changed.notify_all();
    changed.wait_for(lock, std::chrono::minutes(1), [&] { return seen.size() == 3; });
  });
  EXPECT_EQ(seen.size(), 3u);
}

TEST(ParallelFor, ThrowsTheFirstErrorOnceNobodyWorks) {
  std::atomic<int> inside{0}, visited{0};
  const auto body = [&](size_t i) {
    ++inside;
    ++visited;
    if (i == 10) {
      --inside;
      throw std::runtime_error("ten");
    }
    --inside;
  };
  EXPECT_THROW(parallelFor(100000, 2, body), std::runtime_error);
  EXPECT_EQ(inside, 0);
  visited = 0;
  EXPECT_THROW(parallelFor(100000, 1, body), std::runtime_error);
  EXPECT_EQ(visited, 11) << "the rest is left out";
  parallelFor(5, 2, body);  // and the next loop is as any
  EXPECT_EQ(inside, 0);
}

TEST(ParallelFor, ALoopInALoopIsDoneByOneThread) {
  std::vector<int> visits(400, 0);
  parallelFor(20, 2, [&](size_t i) {
    const std::thread::id own = std::this_thread::get_id();
    parallelFor(20, 2, [&](size_t k) {
      visits[20 * i + k] += std::this_thread::get_id() == own ? 1 : 1000;
    });
  });
  EXPECT_EQ(visits, std::vector<int>(400, 1));
}

/// Three callers at once, each of which has a helper in its loop until all are there.
TEST(ParallelFor, EachCallerHasHelpersOfItsOwn) {
  std::mutex mutex;
  std::condition_variable changed;
  std::set<std::thread::id> seen;
  const auto call = [&] {
    parallelFor(2, 2, [&](size_t) {
      std::unique_lock<std::mutex> lock(mutex);
      seen.insert(std::this_thread::get_id());
      changed.notify_all();
      changed.wait_for(lock, std::chrono::minutes(1), [&] { return seen.size() == 6; });
    });
  };
  std::vector<std::thread> callers;
  callers.reserve(3);
  for (int i = 0; i < 3; ++i) callers.emplace_back(call);
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(seen.size(), 6u);
}

TEST(ParallelFor, LessThanOneThreadIsOne) {
  for (const int threads : {0, -3}) {
    int visits = 0;
    parallelFor(50, threads, [&](size_t) { ++visits; });
    EXPECT_EQ(visits, 50);
  }
}

/// A child has no helpers, and ends as any process.
TEST(ParallelFor, AForkedChildWorksAloneAndEnds) {
  int visits = 0;
  parallelFor(2, 2, [&](size_t) { std::this_thread::yield(); });
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(60);  // if it hangs
    parallelFor(50, 2, [&](size_t) { ++visits; });
    exit(visits == 50 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
}

/// The same rows come to the same thread in one loop after the other, where none is behind.
TEST(SharedCount, AThreadTakesItsOwnStretchFirst) {
  SharedCount shared(100, 2, 8);
  std::vector<size_t> firsts;
  shared.visit(1, [&](size_t first, size_t end) {
    firsts.push_back(first);
    EXPECT_EQ(end, std::min<size_t>(first + 8, 100));
  });
  EXPECT_EQ(firsts, (std::vector<size_t>{48, 56, 64, 72, 80, 88, 96, 0, 8, 16, 24, 32, 40}));
  shared.visit(0, [&](size_t, size_t) { ADD_FAILURE() << "all are taken"; });
}

/// Whether it has begun or not, it is in no call that was released, and those it began it ended.
TEST(TeamMember, IsInNoCallThatWasReleased) {
  std::atomic<int> calls{0};
  const auto work = [](const void* of, size_t number) {
    *static_cast<std::atomic<int>*>(const_cast<void*>(of)) += static_cast<int>(number);
  };
  TeamMember member;
  int before = 0;
  for (int i = 0; i < 2000; ++i) {
    member.call(work, &calls, 1);
    if (i % 2 == 0) std::this_thread::sleep_for(std::chrono::microseconds(i % 100));
    member.release();
    const int now = calls;
    EXPECT_LE(now - before, 1);
    std::this_thread::yield();
    EXPECT_EQ(calls, now) << "it began after it was released";
    before = now;
  }
  EXPECT_GT(before, 0);
}

}  // namespace
}  // namespace dtsdf
