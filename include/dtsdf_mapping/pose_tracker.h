/// Finds the poses of depth images by the map alone, one after the other.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// Follows a camera: each image is aligned to the map, starting from where the motion of the last
/// images leads. Once an image does not fit, the camera is lost: nothing is fused, and each image
/// is looked for around the poses of before, until some in a row fit again. Not thread safe.
class PoseTracker {
 public:
  /// @param params Its sigmas say how far a camera departs from its motion between two images.
  explicit PoseTracker(const PoseParams& params) : params_(params) {}

  /// Finds the pose of a frame. The pose in the frame counts only for the first one, which begins
  /// there.
  /// @param mapper Holds the map that the frame is aligned to; nothing is fused.
  /// @param frame Depth image, in the camera's optical frame.
  /// @param stamp_s Of the frame, in seconds; the motion is continued only where stamps rise.
  /// @throws std::exception when the backend fails.
  Alignment track(Mapper& mapper, const DepthFrame& frame, double stamp_s);

  /// Whether the frame that track() was called with last is to be fused at the pose found: only
  /// where it fits, or where its pose was given and the map holds nothing there yet.
  bool isToBeFused(const Alignment& alignment) const;

  /// Continues from a pose that is known, in the map frame: the next frame begins there.
  void setPose(const Eigen::Isometry3d& T_W_C);

  /// Counts the camera as lost, to be looked for around a pose, in a map that it may be anywhere
  /// in. Nothing is fused before it is found.
  /// @param near_T_W_C Where to begin, in the map frame.
  /// @param stamp_s Of the next frame, in seconds.
  void seek(const Eigen::Isometry3d& near_T_W_C, double stamp_s);

  /// The pose of the newest frame that fitted, or where the camera is looked for; none before the
  /// first frame.
  std::optional<Eigen::Isometry3d> lastPose() const;

  /// The pose at a time after the last frame, by the motion so far; none before the first frame and
  /// while the camera is lost.
  std::optional<Eigen::Isometry3d> poseAt(double stamp_s) const;

  /// Whether the camera is lost.
  bool isLost() const { return lost_since_s_.has_value(); }

  /// Stamp of the first frame that did not fit, in seconds; none while the camera is followed.
  std::optional<double> lostSince_s() const { return lost_since_s_; }

 private:
  struct Followed {
    Eigen::Isometry3d T_W_C;
    double stamp_s;
  };

  Alignment begin(Mapper& mapper, const DepthFrame& frame, double stamp_s);
  Alignment follow(Mapper& mapper, const DepthFrame& frame, double stamp_s);
  Alignment search(Mapper& mapper, const DepthFrame& frame, double stamp_s);
  Alignment alignAt(Mapper& mapper, DepthFrame frame, const Eigen::Isometry3d& T_W_C) const;
  void keep(const Eigen::Isometry3d& T_W_C, double stamp_s);
  void rememberPlace(const Eigen::Isometry3d& T_W_C);
  void lose(double stamp_s);
  Eigen::Isometry3d predict(double stamp_s) const;
  Eigen::Isometry3d nextGuess();

  PoseParams params_;
  std::optional<Eigen::Isometry3d> given_T_W_C_;  ///< Where the next frame begins.
  bool may_begin_ = false;                        ///< The last frame's pose was given.
  std::optional<Followed> last_, before_;         ///< The newest frames that fitted.
  std::vector<Eigen::Isometry3d> places_T_W_C_;   ///< Poses of before, apart, the newest last.
  std::optional<double> lost_since_s_;
  int fits_in_a_row_ = 0;    ///< While lost.
  size_t guesses_made_ = 0;  ///< Since it was lost.
};

}  // namespace dtsdf
