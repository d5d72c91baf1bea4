/// When a reader of occupancy_grid_updates may get one, so that costmap_2d's StaticLayer, as it is,
/// never shows a wrong grid.
///
/// That layer adds an update to the last grid without a look at bounds, and gets both by
/// connections of their own: an update that overtook its grid would write beside it. And of what
/// comes between two of its cycles it hands on the place of the last message only: an update soon
/// after a grid would hide the rest of the grid. So an update is sent a moment after the grid that
/// it is counted from; and for some cycles after a grid, updates are all of it. Whoever does
/// likewise is served by this, too; whoever reads with more care loses nothing.
#pragma once

#include <chrono>

#include "ros/common/steady_clock.h"

namespace dtsdf {

class StaticLayerPace {
 public:
  /// An update is sent no sooner after a grid.
  static constexpr std::chrono::milliseconds kGap{200};
  /// For so long after a grid, updates are all of it.
  static constexpr std::chrono::milliseconds kSettling{2000};

  /// The reader is new, or gets a grid now.
  void startOver(SteadyTime now) {
    lacks_ = true;
    not_before_ = now + kGap;
    whole_until_ = now + kSettling;
  }

  /// Something has changed that the reader lacks.
  void noteChange() { lacks_ = true; }

  bool isDue(SteadyTime now) const { return lacks_ && now >= not_before_; }

  /// The update that is due is sent. @return whether it has to be all of the grid.
  bool takeUpdate(SteadyTime now) {
    lacks_ = false;
    return now < whole_until_;
  }

 private:
  bool lacks_ = true;
  SteadyTime not_before_, whole_until_;
};

}  // namespace dtsdf
