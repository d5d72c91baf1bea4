#include "tiles/tile_queue.h"

#include <algorithm>

namespace dtsdf {

TileQueue::TileQueue(const Plan& plan, const std::vector<bool>& done) : plan_(plan) {
  for (size_t i = 0; i < plan.tiles.size(); ++i) {
    if (done[i]) {
      ++done_;
    } else {
      waiting_.push_back(i);
      expected_s_ += plan.tiles[i].estimate.seconds;
    }
  }
  std::stable_sort(waiting_.begin(), waiting_.end(), [&](size_t a, size_t b) {
    return plan.tiles[a].estimate.seconds > plan.tiles[b].estimate.seconds;
  });
}

std::optional<size_t> TileQueue::next() {
  if (waiting_.empty()) return std::nullopt;
  const size_t tile = waiting_.front();
  waiting_.pop_front();
  ++attempts_[tile];
  ++under_way_;
  return tile;
}

bool TileQueue::finish(size_t tile, bool made) {
  --under_way_;
  if (made) {
    ++done_;
    expected_done_s_ += plan_.tiles[tile].estimate.seconds;
    return false;
  }
  if (attempts_[tile] < kMostAttempts) {
    waiting_.push_back(tile);
    return true;
  }
  failed_.push_back(tile);
  return false;
}

size_t TileQueue::attempts(size_t tile) const {
  const auto found = attempts_.find(tile);
  return found == attempts_.end() ? 0 : found->second;
}

std::optional<double> TileQueue::secondsLeft(double elapsed_s) const {
  if (!(expected_done_s_ > 0.0)) return std::nullopt;
  return elapsed_s * (expected_s_ - expected_done_s_) / expected_done_s_;
}

}  // namespace dtsdf
