#include "program/progress_bar.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

TEST(ProgressLine, ShowsWhatIsKnown) {
  EXPECT_NE(progressLine("frames", 25, 100, 5.0).find("25/100 frames, 5.0/s, 15 s left"),
            std::string::npos);
  EXPECT_EQ(progressLine("frames", 7, std::nullopt, 2.0), "7 frames, 3.5/s");
  EXPECT_NE(progressLine("frames", 0, 10, 0.0), "");
  EXPECT_NE(progressLine("frames", 0, 0, 0.0), "");
  // The percentage is at most 100 %.
  EXPECT_NE(progressLine("frames", 11, 10, 1.0).find("100 %"), std::string::npos);
}

}  // namespace
}  // namespace dtsdf
