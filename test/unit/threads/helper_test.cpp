// Tests that a helper thread runs one task at a time and passes exceptions on to the thread that
// waits for the task.
#include "threads/helper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace dtsdf {
namespace {

TEST(Helper, RunsTasksOneAfterAnother) {
  int done = 0;  // changed only by tasks, and read once they are done
  Helper helper;
  helper.wait();
  for (int i = 0; i < 200; ++i) {
    helper.start([&done, i] {
      if (i % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
      ++done;
    });
    if (i % 3 == 0) {
      helper.wait();
      EXPECT_EQ(done, i + 1);
    }
  }
  helper.wait();
  EXPECT_EQ(done, 200);
}

TEST(Helper, RethrowsEachExceptionOnce) {
  Helper helper;
  helper.start([] { throw std::runtime_error("a task fails"); });
  EXPECT_THROW(helper.wait(), std::runtime_error);
  EXPECT_NO_THROW(helper.wait());
  bool is_done = false;
  helper.start([] { throw std::runtime_error("another task fails"); });
  EXPECT_THROW(helper.start([&is_done] { is_done = true; }), std::runtime_error);
  EXPECT_FALSE(is_done) << "the task should not be started after an exception";
  helper.start([&is_done] { is_done = true; });
  helper.wait();
  EXPECT_TRUE(is_done);
}

TEST(Helper, DestructorWaitsForTheTask) {
  std::atomic<bool> is_done{false};
  {
    Helper helper;
    helper.start([&is_done] {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      is_done = true;
    });
  }
  EXPECT_TRUE(is_done);
}

}  // namespace
}  // namespace dtsdf
