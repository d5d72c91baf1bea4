#include "dtsdf_mapping/pose_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dtsdf_mapping/place_search.h"
#include "poses/between.h"

namespace dtsdf {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Minimum fraction of the image's points that must lie on surfaces at a pose found by search. A
/// smaller fraction may match by chance.
constexpr double kFoundShare = 0.5;

/// Number of consecutive images that must be aligned before tracking resumes: two give a motion,
/// and the third confirms it.
constexpr int kFitsToRecover = 3;

/// Guesses per place: six turns and six shifts by one step, as many by two steps, and the place's
/// own pose.
constexpr int kGuessesPerPlace = 1 + 4 * 6;

/// Guesses per image while the camera is lost, in addition to the predicted pose. On a CPU, seven
/// alignments take hardly longer than aligning once and fusing, so the frame rate does not drop.
constexpr int kGuessesPerImage = 6;

/// Maximum number of places to search around: at 30 images per second, all guesses are tried in
/// about two seconds.
constexpr size_t kMaxPlaces = 16;

/// A camera that has been lost for kLostTimeout_s may be anywhere, so the whole map is searched, at
/// most every kSearchInterval_s. For a camera that was never found in the map, this search starts
/// immediately.
constexpr double kLostTimeout_s = 2.0, kSearchInterval_s = 1.0;

double turnBetween(const Isometry3d& a, const Isometry3d& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
}

/// Continues the motion from one pose to another by `share` times that motion. The rotation is
/// about the camera.
Isometry3d continued(const Isometry3d& from, const Isometry3d& to, double share) {
  const Eigen::AngleAxisd turn(from.linear().transpose() * to.linear());
  const Vector3d way = from.linear().transpose() * (to.translation() - from.translation());
  Isometry3d T_W_C = to;
  T_W_C.translation() += to.linear() * (share * way);
  T_W_C.rotate(Eigen::AngleAxisd(share * turn.angle(), turn.axis()));
  T_W_C.linear() = Eigen::Quaterniond(T_W_C.linear()).normalized().toRotationMatrix();
  return T_W_C;
}

/// The larger of the shift in metres and the turn in radians, which equals the shift of points at a
/// distance of 1 m.
double motionBetween(const Isometry3d& a, const Isometry3d& b) {
  return std::max((b.translation() - a.translation()).norm(), turnBetween(a, b));
}

/// A guess near a pose: the pose turned about or shifted along one of its axes by one or two steps,
/// or the pose itself. A step is as long as the maximum distance that an alignment can correct
/// (`reach_m`). This is short for fine voxels, so a shift is at least kMinShift_m. A turn by
/// one step is at most kMaxTurn_rad.
Isometry3d guessAround(const Isometry3d& T_W_C, double reach_m, size_t guess) {
  constexpr double kMinShift_m = 0.15, kMaxTurn_rad = 0.3;
  if (guess + 1 == kGuessesPerPlace) return T_W_C;
  const size_t ring = guess / 12, axis = guess % 6 / 2;
  const double steps = (guess % 2 == 0 ? 1.0 : -1.0) * static_cast<double>(1 + ring);
  const Vector3d along = Vector3d::Unit(static_cast<Eigen::Index>(axis));
  Isometry3d T = T_W_C;
  const double shift_m = std::max(reach_m, kMinShift_m);
  const double turn_rad = std::min(shift_m, kMaxTurn_rad);
  if (guess % 12 < 6) return T.rotate(Eigen::AngleAxisd(steps * turn_rad, along));
  return T.translate(steps * shift_m * along);
}

}  // namespace

Alignment PoseTracker::track(Mapper& mapper, const DepthFrame& frame, double stamp_s) {
  if (!last_ && !given_T_W_C_) given_T_W_C_ = frame.T_W_C;
  may_begin_ = false;
  if (given_T_W_C_) return begin(mapper, frame, stamp_s);
  return isLost() ? search(mapper, frame, stamp_s) : follow(mapper, frame, stamp_s);
}

bool PoseTracker::shouldFuse(const Alignment& alignment) const {
  return alignment.status == AlignmentStatus::kAligned ||
         (alignment.status == AlignmentStatus::kUnmapped && may_begin_);
}

void PoseTracker::setPose(const Isometry3d& T_W_C) {
  given_T_W_C_ = T_W_C;
  last_ = before_ = std::nullopt;
  lost_since_s_.reset();
}

/// The step from `near_T_W_C` to the found pose is not a motion, so an infinitely old stamp
/// prevents extrapolation.
void PoseTracker::seek(const Isometry3d& near_T_W_C, double stamp_s) {
  given_T_W_C_.reset();
  before_.reset();
  last_ = StampedPose{-std::numeric_limits<double>::infinity(), near_T_W_C};
  places_T_W_C_ = {near_T_W_C};
  was_found_ = false;
  lose(stamp_s);
}

std::optional<Isometry3d> PoseTracker::lastPose() const {
  if (given_T_W_C_) return given_T_W_C_;
  if (!last_) return std::nullopt;
  return last_->T_W_C;
}

std::optional<Isometry3d> PoseTracker::poseAt(double stamp_s) const {
  if (!last_ || isLost()) return std::nullopt;
  return predict(stamp_s);
}

Alignment PoseTracker::begin(Mapper& mapper, const DepthFrame& frame, double stamp_s) {
  Alignment alignment = alignAt(mapper, frame, *given_T_W_C_);
  // given_T_W_C_ is kept until the map has voxels, since a frame without measurements does not
  // begin the map.
  const bool map_is_empty = mapper.stats().voxel_arrays == 0;
  may_begin_ = map_is_empty || !last_;
  last_ = StampedPose{stamp_s, alignment.T_W_C};
  before_.reset();
  const bool is_elsewhere = alignment.status == AlignmentStatus::kUnmapped && !may_begin_;
  if (alignment.status == AlignmentStatus::kMisfit || is_elsewhere) {
    lose(stamp_s);
  }
  rememberPlace(alignment.T_W_C);
  if (!map_is_empty) given_T_W_C_.reset();
  was_found_ = !isLost();
  return alignment;
}

Alignment PoseTracker::follow(Mapper& mapper, const DepthFrame& frame, double stamp_s) {
  Alignment alignment = alignAt(mapper, frame, predict(stamp_s));
  if (alignment.status == AlignmentStatus::kAligned) {
    keep(alignment.T_W_C, stamp_s);
    rememberPlace(alignment.T_W_C);
    return alignment;
  }
  lose(stamp_s);
  return search(mapper, frame, stamp_s);
}

/// Searches at the predicted pose, around earlier places, and if necessary in the whole map.
Alignment PoseTracker::search(Mapper& mapper, const DepthFrame& frame, double stamp_s) {
  Alignment found = alignAt(mapper, frame, predict(stamp_s));
  const bool continues = explainedBy(found) >= kFoundShare;
  for (int i = 0; i < kGuessesPerImage && !continues; ++i) {
    const Alignment other = alignAt(mapper, frame, nextGuess());
    if (explainedBy(other) > explainedBy(found)) found = other;
  }
  if (explainedBy(found) < kFoundShare) found = searchWholeMap(mapper, frame, stamp_s, found);
  if (explainedBy(found) >= kFoundShare) {
    if (!continues) last_.reset();  // the step to a guess is not a motion
    keep(found.T_W_C, stamp_s);
    ++fits_in_a_row_;
  } else {
    fits_in_a_row_ = 0;
  }
  if (fits_in_a_row_ >= kFitsToRecover) {
    lost_since_s_.reset();
    was_found_ = true;
  } else if (found.status == AlignmentStatus::kAligned) {
    found.status = AlignmentStatus::kUnsure;
  }
  return found;
}

/// Searches the whole map if a search is due. @return the result if it is conclusive, otherwise
/// `before`.
Alignment PoseTracker::searchWholeMap(Mapper& mapper, const DepthFrame& frame, double stamp_s,
                                      const Alignment& before) {
  const bool may_be_anywhere = !was_found_ || stamp_s - *lost_since_s_ >= kLostTimeout_s;
  const bool searched_recently =
      searched_map_s_ && std::abs(stamp_s - *searched_map_s_) < kSearchInterval_s;
  const bool shows_nothing = before.witnesses < 1.0;  // for example, if the lens is covered
  if (!may_be_anywhere || searched_recently || shows_nothing) return before;
  searched_map_s_ = stamp_s;
  const FoundPlace place = findPlace(mapper, frame, threads_);
  const bool is_conclusive = place.alignment.status == AlignmentStatus::kAligned ||
                             place.alignment.status == AlignmentStatus::kAmbiguous;
  return is_conclusive ? place.alignment : before;
}

Alignment PoseTracker::alignAt(Mapper& mapper, DepthFrame frame, const Isometry3d& T_W_C) {
  frame.T_W_C = T_W_C;
  Alignment alignment = mapper.align(frame, {params_.sigma_m, params_.sigma_rad});
  if (alignment.status == AlignmentStatus::kAligned && !alignment.is_held) {
    alignment.status = AlignmentStatus::kMisfit;
    alignment.T_W_C = T_W_C;  // too few points fit, so the aligned pose may be wrong
    alignment.covariance.setZero();
    alignment.covariance.diagonal() << Vector3d::Constant(params_.sigma_m * params_.sigma_m),
        Vector3d::Constant(params_.sigma_rad * params_.sigma_rad);
  }
  reach_m_ = alignment.reach_m;
  return alignment;
}

void PoseTracker::keep(const Isometry3d& T_W_C, double stamp_s) {
  before_ = last_;
  last_ = StampedPose{stamp_s, T_W_C};
}

/// Moves the newest place along with the camera. Adds a place once the camera is at least twice
/// reach_m_ away from the second newest place.
void PoseTracker::rememberPlace(const Isometry3d& T_W_C) {
  const size_t count = places_T_W_C_.size();
  if (count > 1 && motionBetween(places_T_W_C_[count - 2], T_W_C) < 2.0 * reach_m_) {
    places_T_W_C_.back() = T_W_C;
    return;
  }
  if (count == kMaxPlaces) places_T_W_C_.erase(places_T_W_C_.begin());
  places_T_W_C_.push_back(T_W_C);
}

void PoseTracker::lose(double stamp_s) {
  lost_since_s_ = stamp_s;
  fits_in_a_row_ = 0;
  guesses_made_ = 0;
  searched_map_s_.reset();
}

/// Extrapolates the motion. If more than one image is missing, a motion that an alignment could not
/// correct (more than reach_m_) is not extrapolated.
Isometry3d PoseTracker::predict(double stamp_s) const {
  if (!before_) return last_->T_W_C;
  const double between_s = last_->stamp_s - before_->stamp_s, ahead_s = stamp_s - last_->stamp_s;
  if (!(between_s > 0.0) || !(ahead_s > 0.0)) return last_->T_W_C;
  const double share = ahead_s / between_s;
  const Isometry3d ahead = continued(before_->T_W_C, last_->T_W_C, share);
  const bool is_far = motionBetween(last_->T_W_C, ahead) > reach_m_;
  constexpr double kOneMissing = 2.5;  // 2 at an even rate, but stamps vary
  return share > kOneMissing && is_far ? last_->T_W_C : ahead;
}

/// The next guess to try; those around the newest place come first.
Isometry3d PoseTracker::nextGuess() {
  if (places_T_W_C_.empty()) return last_->T_W_C;
  const size_t guess = guesses_made_++ % (places_T_W_C_.size() * kGuessesPerPlace);
  const size_t place = places_T_W_C_.size() - 1 - guess / kGuessesPerPlace;
  return guessAround(places_T_W_C_[place], reach_m_, guess % kGuessesPerPlace);
}

}  // namespace dtsdf
