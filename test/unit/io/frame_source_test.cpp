#include "dtsdf_mapping/io/frame_source.h"

#include <gtest/gtest.h>

namespace dtsdf {
namespace {

TEST(FrameSelection, CountAgreesWithContains) {
  for (size_t first : {0, 1, 4, 9, 12}) {
    for (size_t last : {0, 3, 9, 50}) {
      for (size_t step : {1, 2, 3, 20}) {
        for (size_t total : {0, 1, 5, 10}) {
          const FrameSelection selection{first, last, step, {}};
          size_t count = 0;
          for (size_t i = 0; i < total; ++i) count += selection.contains(i);
          EXPECT_EQ(selection.countIn(total), count)
              << first << ":" << last << ":" << step << " of " << total;
        }
      }
    }
  }
}

}  // namespace
}  // namespace dtsdf
