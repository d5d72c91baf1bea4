#include "dtsdf_mapping/alignment_gain.h"

#include <algorithm>
#include <cmath>

#include "poses/between.h"

namespace dtsdf {
namespace {

/// The mean square of kRemembered third differences of positions may be off by this factor.
/// Consecutive differences overlap, so 8 of them on three axes amount to only about 11 independent
/// samples, whose mean square has a relative standard deviation of 0.42. More images would mix
/// different places and motions.
constexpr double kUncertainty = 2.0;
constexpr int kRemembered = 8;

}  // namespace

bool AlignmentGain::Variance::isKnown() const { return seen >= kRemembered; }

bool AlignmentGain::Variance::add(const Step& step) {
  bool is_jump = false;
  if (before) {
    // The third difference of positions with independent errors e is e_0 - 3 e_1 + 3 e_2 - e_3.
    const Step third = step - 2.0 * *last + *before;
    constexpr double kSquares = 1.0 + 9.0 + 9.0 + 1.0;
    const double of_shift = third.head<3>().squaredNorm() / kSquares;
    const double of_turn = third.tail<3>().squaredNorm() / kSquares;
    constexpr double kMax = kMaxDeviations * kMaxDeviations;
    is_jump = isKnown() && (of_shift > kMax * m2 || of_turn > kMax * rad2);
    seen = std::min(seen + 1, kRemembered);
    m2 += (of_shift - m2) / seen;
    rad2 += (of_turn - rad2) / seen;
  }
  before = last;
  last = step;
  return is_jump;
}

void AlignmentGain::addGiven(const Eigen::Isometry3d& T_O_C) {
  if (T_O_C_) given_.add(stepBetween(*T_O_C_, T_O_C));
  T_O_C_ = T_O_C;
}

bool AlignmentGain::addAligned(const Eigen::Isometry3d& T_W_C) {
  const bool jumps = T_W_O_ && aligned_.add(stepBetween(*T_W_O_ * *T_O_C_, T_W_C));
  if (jumps) aligned_ = Variance();
  T_W_O_ = T_W_C * T_O_C_->inverse();
  return jumps;
}

double AlignmentGain::share(const Eigen::Isometry3d& expected_T_W_C,
                            const Eigen::Isometry3d& aligned_T_W_C) const {
  if (!given_.isKnown() || !aligned_.isKnown()) return 1.0;
  const auto gain = [](double given, double aligned) {
    const double of_alignments = std::max(0.0, aligned - kUncertainty * given);
    return of_alignments > 0.0 ? given / (given + of_alignments) : 1.0;
  };
  const Step way = stepBetween(expected_T_W_C, aligned_T_W_C);
  const auto beyond_noise = [](double way, double variance) {
    const double noise = kMaxDeviations * std::sqrt(variance);
    return way > noise ? 1.0 - noise / way : 0.0;
  };
  return std::max({std::min(gain(given_.m2, aligned_.m2), gain(given_.rad2, aligned_.rad2)),
                   beyond_noise(way.head<3>().norm(), aligned_.m2),
                   beyond_noise(way.tail<3>().norm(), aligned_.rad2)});
}

}  // namespace dtsdf
