// Tests that parallel loops visit each index once, use all threads, and rethrow exceptions.
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

/// In many nearly empty loops, helper threads are woken, released and woken again.
TEST(ParallelFor, LosesNothingBetweenLoops) {
  for (size_t loop = 0; loop < 20000; ++loop) {
    int visits[3] = {};
    parallelFor(3, 3, [&](size_t i) { ++visits[i]; });
    ASSERT_EQ(std::accumulate(visits, visits + 3, 0), 3) << loop;
  }
}

/// Each thread waits until all three threads have entered the body.
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

TEST(ParallelFor, ThrowsOnceAllThreadsHaveStopped) {
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
  EXPECT_EQ(visited, 11) << "the loop should stop after an exception";
  parallelFor(5, 2, body);  // the next loop works as usual
  EXPECT_EQ(inside, 0);
}

TEST(ParallelFor, NestedLoopsRunOnOneThread) {
  std::vector<int> visits(400, 0);
  parallelFor(20, 2, [&](size_t i) {
    const std::thread::id own = std::this_thread::get_id();
    parallelFor(20, 2, [&](size_t k) {
      visits[20 * i + k] += std::this_thread::get_id() == own ? 1 : 1000;
    });
  });
  EXPECT_EQ(visits, std::vector<int>(400, 1));
}

/// A forked child process has no helper threads, but runs loops and ends normally.
TEST(ParallelFor, WorksInAForkedChild) {
  int visits = 0;
  parallelFor(2, 2, [&](size_t) { std::this_thread::yield(); });
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(60);  // in case the loop hangs
    parallelFor(50, 2, [&](size_t) { ++visits; });
    exit(visits == 50 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
}

}  // namespace
}  // namespace dtsdf
