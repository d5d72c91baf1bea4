#include "ros/common/worker_thread.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace dtsdf {
namespace {

using std::chrono::milliseconds;
constexpr milliseconds kForEver{3600 * 1000};

TEST(WorkerThread, RepeatsItsStepUntilThereIsNothingToDo) {
  std::atomic<int> steps{0};
  std::promise<void> third;
  WorkerThread worker("test");
  worker.start([&] {
    if (++steps == 3) third.set_value();
    return steps < 3 ? milliseconds(0) : kForEver;
  });
  third.get_future().get();
  worker.stop();
  EXPECT_EQ(steps, 3);
}

TEST(WorkerThread, WakingEndsTheWait) {
  std::atomic<int> steps{0};
  std::promise<void> first, second;
  WorkerThread worker("test");
  worker.start([&] {
    const int step = ++steps;
    if (step == 1) first.set_value();
    if (step == 2) second.set_value();
    return kForEver;
  });
  first.get_future().get();
  worker.wake();
  second.get_future().get();
}

TEST(WorkerThread, RunsTasksInOrderOnItsThread) {
  WorkerThread worker("test");
  worker.start([] { return kForEver; });
  std::vector<int> order;
  auto first = worker.run([&] {
    order.push_back(1);
    return std::this_thread::get_id();
  });
  auto second = worker.run([&] {
    order.push_back(2);
    return std::this_thread::get_id();
  });
  EXPECT_EQ(first.get(), second.get());
  EXPECT_EQ(order, (std::vector<int>{1, 2}));
}

TEST(WorkerThread, LowPriorityAffectsOnlyItsThread) {
  const auto niceness = [] { return getpriority(PRIO_PROCESS, 0); };
  const int before = niceness();
  constexpr int kGreatest = 19;
  if (before >= kGreatest) GTEST_SKIP() << "already running with the lowest priority";
  WorkerThread normal("normal"), low("low", kLowNiceness);
  normal.start([] { return kForEver; });
  low.start([] { return kForEver; });
  EXPECT_GT(low.run(niceness).get(), before);
  EXPECT_EQ(normal.run(niceness).get(), before);
  EXPECT_EQ(niceness(), before);
}

TEST(WorkerThread, PassesExceptionsOnAndContinues) {
  WorkerThread worker("test");
  worker.start([] { return kForEver; });
  auto failing = worker.run([]() -> int { throw std::runtime_error("no"); });
  EXPECT_THROW(failing.get(), std::runtime_error);
  EXPECT_EQ(worker.run([] { return 7; }).get(), 7);
}

TEST(WorkerThread, StopFailsWaitingTasks) {
  std::promise<void> started, go_on;
  WorkerThread worker("test");
  worker.start([] { return kForEver; });
  auto running = worker.run([&] {
    started.set_value();
    go_on.get_future().get();
    return 1;
  });
  started.get_future().get();
  auto waiting = worker.run([] { return 2; });
  std::thread stopper([&] { worker.stop(); });
  EXPECT_THROW(waiting.get(), std::future_error)
      << "queued tasks should be dropped before the running task ends";
  go_on.set_value();
  stopper.join();
  EXPECT_EQ(running.get(), 1);
  auto late = worker.run([] { return 3; });
  EXPECT_THROW(late.get(), std::future_error);
  worker.stop();  // a second call is harmless
}

TEST(WorkerThread, StopsDespiteManyWaitingTasks) {
  ros::Time::init();
  std::atomic<int> calls{0}, steps{0};
  const auto begin = std::chrono::steady_clock::now();
  {
    WorkerThread thread("test");
    for (int i = 0; i < 1000; ++i) {
      thread.run([&] {
        ++calls;
        std::this_thread::sleep_for(milliseconds(20));
      });
    }
    thread.start([&] {
      ++steps;
      return kForEver;
    });
    while (steps == 0) std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_LT(calls, 1000);
}

}  // namespace
}  // namespace dtsdf
