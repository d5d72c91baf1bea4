/// Which tile is next: the longest first, and one that failed once more at the end.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "tiles/plan.h"

namespace dtsdf {

class TileQueue {
 public:
  /// Those tiles are done already.
  TileQueue(const Plan& plan, const std::vector<bool>& done);

  /// The next tile to make, or nothing: then others may still be under way, which may fail.
  std::optional<size_t> next();

  /// A tile that next() gave is made, or not. @return whether it will be tried again.
  bool finish(size_t tile, bool made);

  bool isOver() const { return waiting_.empty() && under_way_ == 0; }
  const std::vector<size_t>& failed() const { return failed_; }
  size_t attempts(size_t tile) const;
  size_t doneCount() const { return done_; }
  size_t count() const { return plan_.tiles.size(); }

  /// What is left, if it goes on as it did since this queue began, `elapsed_s` ago.
  std::optional<double> secondsLeft(double elapsed_s) const;

 private:
  static constexpr size_t kMostAttempts = 2;

  const Plan& plan_;
  std::deque<size_t> waiting_;
  std::map<size_t, size_t> attempts_;
  std::vector<size_t> failed_;
  size_t under_way_ = 0, done_ = 0;
  double expected_s_ = 0.0, expected_done_s_ = 0.0;  ///< By the plan, of what this queue makes.
};

}  // namespace dtsdf
