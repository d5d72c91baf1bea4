#include "ros/input/frame_queue.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <string>
#include <vector>

#include "ros/support/fake_clock.h"

namespace dtsdf {
namespace {

/// Items that are their own names.
class MergeQueueTest : public testing::Test {
 protected:
  using Queue = MergeQueue<std::string>;

  bool push(Queue::Stream stream, double stamp_s, const std::string& item) {
    return queue_.push(stream, ros::Time(stamp_s), std::string(item));
  }

  /// All that can be taken now.
  std::string take() {
    std::string taken;
    while (const auto item = queue_.take()) taken += *item;
    return taken;
  }

  FakeClock clock_;
  int changes_ = 0;
  Queue queue_{0.1, [this] { ++changes_; }, clock_.reader()};
};

TEST_F(MergeQueueTest, ASingleStreamWaitsForNothingAndStaysAsItIs) {
  const auto stream = queue_.addStream({});
  EXPECT_FALSE(queue_.hasTurn());
  EXPECT_TRUE(push(stream, 2.0, "b"));
  EXPECT_TRUE(push(stream, 1.0, "a"));
  EXPECT_TRUE(queue_.hasTurn());
  EXPECT_EQ(take(), "ba");
  EXPECT_TRUE(push(stream, 0.5, "c"));
  EXPECT_EQ(take(), "c");
  EXPECT_EQ(changes_, 3);
}

TEST_F(MergeQueueTest, StampsDecideOnceEachStreamHasGoneOn) {
  const auto front = queue_.addStream({0, "front"});
  const auto rear = queue_.addStream({0, "rear"});
  EXPECT_TRUE(push(rear, 1.1, "b"));
  EXPECT_EQ(take(), "") << "front may still bring an earlier one";
  EXPECT_TRUE(push(front, 1.0, "a"));
  EXPECT_EQ(take(), "a") << "front may bring another one before 1.1";
  EXPECT_TRUE(push(front, 1.2, "c"));
  EXPECT_EQ(take(), "b");
  queue_.settle(rear, ros::Time(1.3));
  EXPECT_EQ(take(), "c");
}

TEST_F(MergeQueueTest, TiesGoByRankAndThenByName) {
  const auto rear_second = queue_.addStream({1, "rear"});
  const auto rear = queue_.addStream({0, "rear"});
  const auto front_second = queue_.addStream({1, "front"});
  const auto front = queue_.addStream({0, "front"});
  EXPECT_TRUE(push(rear_second, 1.0, "4"));
  EXPECT_TRUE(push(front_second, 1.0, "3"));
  EXPECT_TRUE(push(rear, 1.0, "2"));
  EXPECT_TRUE(push(front, 1.0, "1"));
  EXPECT_EQ(take(), "1234");
}

TEST_F(MergeQueueTest, NobodyWaitsForLongerThanTheWait) {
  queue_.addStream({0, "silent"});
  const auto stream = queue_.addStream({0, "stream"});
  EXPECT_TRUE(push(stream, 1.0, "a"));
  clock_.advance(0.06);
  EXPECT_TRUE(push(stream, 2.0, "b"));
  EXPECT_NEAR(std::chrono::duration<double>(queue_.idleTime()).count(), 0.04, 1e-6);
  EXPECT_EQ(take(), "");
  clock_.advance(0.04);
  EXPECT_EQ(take(), "a");
  clock_.advance(0.06);
  EXPECT_EQ(take(), "b");
  EXPECT_EQ(queue_.idleTime(), SteadyDuration::max());
}

TEST_F(MergeQueueTest, WhatComesLateGoesAtOnceBeforeWhatHasWaitedForIt) {
  const auto front = queue_.addStream({0, "front"});
  const auto rear = queue_.addStream({0, "rear"});
  queue_.addStream({0, "silent"});
  EXPECT_TRUE(push(rear, 1.1, "b"));
  clock_.advance(0.1);
  EXPECT_TRUE(push(front, 1.0, "a"));
  EXPECT_EQ(take(), "ab");
}

TEST_F(MergeQueueTest, WhatIsOlderThanTheLastIsRefused) {
  const auto front = queue_.addStream({0, "front"});
  const auto rear = queue_.addStream({0, "rear"});
  EXPECT_TRUE(push(rear, 1.1, "b"));
  clock_.advance(0.1);
  EXPECT_EQ(take(), "b");
  EXPECT_FALSE(push(front, 1.0, "late"));
  EXPECT_TRUE(push(front, 1.1, "tie"));
  EXPECT_EQ(take(), "tie");
  queue_.forgetStamps();
  EXPECT_TRUE(push(front, 0.1, "anew"));
}

TEST_F(MergeQueueTest, StreamsCanBeEmptiedAlone) {
  const auto front = queue_.addStream({0, "front"});
  const auto rear = queue_.addStream({0, "rear"});
  EXPECT_TRUE(push(front, 1.0, "a"));
  EXPECT_TRUE(push(rear, 1.0, "b"));
  EXPECT_TRUE(push(front, 2.0, "c"));
  EXPECT_EQ(queue_.sizeOf(front), 2u);
  EXPECT_EQ(queue_.sumOf(front, [](const std::string& item) { return item.size(); }), 2u);
  EXPECT_EQ(queue_.takeOf(front), "a");
  EXPECT_EQ(queue_.takeAllOf(front), std::deque<std::string>{"c"});
  EXPECT_EQ(queue_.takeOf(front), std::nullopt);
  EXPECT_EQ(queue_.size(), 1u);
  EXPECT_EQ(queue_.sizeOf(rear), 1u);
}

/// However the streams' deliveries interleave, what comes in time is taken in one and the same
/// order.
TEST_F(MergeQueueTest, TheOrderDoesNotDependOnTheArrival) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    Queue queue(
        1.0, [] {}, clock_.reader());
    const std::vector<std::string> names{"a", "b", "c"};
    for (const std::string& name : names) queue.addStream({0, name});
    std::vector<int> next(names.size(), 0);
    std::string taken, expected;
    for (int i = 0; i < 10; ++i) expected += std::string("a") + "b" + "c";
    for (int pushes = 0; pushes < 30;) {
      const size_t stream = random() % names.size();
      if (next[stream] == 10) continue;
      ASSERT_TRUE(queue.push(stream, ros::Time(1.0 + next[stream]++), std::string(names[stream])));
      ++pushes;
      while (const auto item = queue.take()) taken += *item;
    }
    ASSERT_EQ(taken, expected) << "round " << round;
  }
}

/// As colour is beside depth: nobody waits for it before it has come.
TEST_F(MergeQueueTest, AnExtraStreamCountsFromItsFirstItemOn) {
  const auto depth = queue_.addStream({0, ""});
  const auto colour = queue_.addStream({1, ""}, StreamUse::kExtra);
  EXPECT_TRUE(push(depth, 2.0, "b"));
  EXPECT_TRUE(push(depth, 1.0, "a"));
  EXPECT_EQ(take(), "ba") << "as if depth were alone";
  queue_.settle(colour, ros::Time(0.5));
  EXPECT_TRUE(push(depth, 2.1, "c"));
  EXPECT_EQ(take(), "c") << "what was dropped of colour is no item";
  EXPECT_TRUE(push(colour, 2.5, "C"));
  EXPECT_EQ(take(), "") << "depth may bring an earlier one";
  EXPECT_TRUE(push(depth, 2.5, "d"));
  EXPECT_EQ(take(), "dC");
  EXPECT_TRUE(push(depth, 3.0, "e"));
  EXPECT_EQ(take(), "") << "colour may bring an earlier one";
  EXPECT_TRUE(push(colour, 2.9, "D"));
  EXPECT_TRUE(push(colour, 3.1, "E"));
  EXPECT_EQ(take(), "De");
}

TEST_F(MergeQueueTest, ExtrasCanBeTakenThatAreEarlier) {
  const auto depth = queue_.addStream({0, ""});
  const auto colour = queue_.addStream({1, ""}, StreamUse::kExtra);
  EXPECT_TRUE(queue_.isNeeded(depth));
  EXPECT_FALSE(queue_.isNeeded(colour));
  EXPECT_TRUE(push(colour, 1.0, "A"));
  EXPECT_TRUE(push(depth, 1.5, "b"));
  EXPECT_TRUE(push(colour, 2.0, "C"));
  EXPECT_TRUE(push(colour, 3.0, "D"));
  EXPECT_EQ(queue_.takeExtraBefore(ros::Time(3.0)), "A");
  EXPECT_EQ(queue_.takeExtraBefore(ros::Time(3.0)), "C");
  EXPECT_FALSE(queue_.takeExtraBefore(ros::Time(3.0)));
  EXPECT_EQ(queue_.sizeOf(colour), 1u);
  EXPECT_EQ(queue_.sizeOf(depth), 1u);
}

TEST_F(MergeQueueTest, WhatIsPushedOutIsNotAlwaysOfOneStream) {
  const auto front = queue_.addStream({0, "front"});
  const auto rear = queue_.addStream({0, "rear"});
  constexpr size_t kRoom = 5;
  int front_taken = 0, rear_taken = 0;
  for (int second = 0; second < 300; ++second) {
    EXPECT_TRUE(push(front, second, "f"));
    if (queue_.sizeOf(front) > kRoom) {
      EXPECT_TRUE(queue_.pushOut(front));
    }
    EXPECT_TRUE(push(rear, second, "r"));
    if (queue_.sizeOf(rear) > kRoom) {
      EXPECT_TRUE(queue_.pushOut(rear));
    }
    if (second % 2 != 0 || second < 50) continue;
    const auto item = queue_.take();
    ASSERT_TRUE(item);
    ++(*item == "f" ? front_taken : rear_taken);
    EXPECT_LE(queue_.sizeOf(front), kRoom);
    EXPECT_LE(queue_.sizeOf(rear), kRoom);
    EXPECT_TRUE(queue_.holdsBefore(rear, ros::Time(second)));
    EXPECT_FALSE(queue_.holdsBefore(rear, ros::Time(second - 2.0 * kRoom)));
  }
  EXPECT_NEAR(front_taken, rear_taken, 2);
}

/// Those that still wait for another stream are no backlog.
TEST_F(MergeQueueTest, BacklogIsWhatWaitsToBeTakenOnly) {
  const auto front = queue_.addStream({0, "front"});
  const auto rear = queue_.addStream({0, "rear"});
  for (const double stamp_s : {1.0, 2.0, 3.0}) EXPECT_TRUE(push(front, stamp_s, "f"));
  EXPECT_EQ(queue_.backlogOf(front), 0u);
  EXPECT_TRUE(push(rear, 2.0, "r"));
  EXPECT_EQ(queue_.backlogOf(front), 2u);
  EXPECT_EQ(queue_.backlogOf(rear), 1u);
}

TEST_F(MergeQueueTest, ASingleStreamLosesItsOldest) {
  const auto depth = queue_.addStream({0, ""});
  EXPECT_FALSE(queue_.pushOut(depth));
  EXPECT_TRUE(push(depth, 1.0, "a"));
  EXPECT_TRUE(push(depth, 2.0, "b"));
  EXPECT_EQ(queue_.pushOut(depth), "a");
  EXPECT_FALSE(queue_.holdsBefore(depth, ros::Time(3.0))) << "nothing is merged";
}

TEST_F(MergeQueueTest, AnExtraStreamNeverCostsAnItem) {
  const auto depth = queue_.addStream({0, ""});
  const auto colour = queue_.addStream({1, ""}, StreamUse::kExtra);
  EXPECT_TRUE(push(depth, 1.0, "a"));
  EXPECT_TRUE(push(colour, 2.0, "B"));
  clock_.advance(0.1);
  EXPECT_EQ(take(), "aB");
  EXPECT_TRUE(push(depth, 1.5, "late"));
  EXPECT_EQ(take(), "late") << "depth is not refused for colour that was taken";
  EXPECT_TRUE(push(depth, 3.0, "c"));
  clock_.advance(0.1);
  EXPECT_EQ(take(), "c") << "colour has stopped";
  EXPECT_TRUE(push(colour, 2.5, "LATE"));
  EXPECT_EQ(take(), "LATE") << "nor is colour refused";
}

}  // namespace
}  // namespace dtsdf
