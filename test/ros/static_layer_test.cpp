#include "ros/steps/space.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

using std::chrono::milliseconds;

TEST(StaticLayerPace, UpdatesKeepAwayFromTheirGrid) {
  const SteadyTime start{milliseconds(1000)};
  StaticLayerPace pace;
  EXPECT_FALSE(pace.isDue(start)) << "no grid was published yet";
  pace.startOver(start);
  EXPECT_FALSE(pace.isDue(start + milliseconds(199)));
  EXPECT_TRUE(pace.isDue(start + milliseconds(200)));
  EXPECT_TRUE(pace.takeUpdate(start + milliseconds(200))) << "all of the grid";
  EXPECT_FALSE(pace.isDue(start + milliseconds(300))) << "it lacks nothing";
  pace.noteChange();
  EXPECT_TRUE(pace.isDue(start + milliseconds(300)));
  EXPECT_TRUE(pace.takeUpdate(start + milliseconds(1999)));
  pace.noteChange();
  EXPECT_FALSE(pace.takeUpdate(start + milliseconds(2000))) << "what has changed will do";
  pace.startOver(start + milliseconds(3000));
  EXPECT_FALSE(pace.isDue(start + milliseconds(3100)));
  EXPECT_TRUE(pace.takeUpdate(start + milliseconds(3200)));
}

}  // namespace
}  // namespace dtsdf
