/// Tracks a depth camera against the map, image by image.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// Each image is aligned to the map, starting from the pose that the motion of the last two images
/// predicts. If an image does not fit, the camera is lost: nothing is fused, and each image is
/// aligned from guesses around earlier poses, until several images in a row fit. After two seconds,
/// or at once if the camera was never found in the map, the whole map is searched (place_search.h).
/// Not thread safe.
class PoseTracker {
 public:
  /// @param params The sigmas are the expected errors of predicted poses.
  /// @param threads Threads that search the whole map; 0: all cores.
  explicit PoseTracker(const PoseParams& params, int threads = 0)
      : params_(params), threads_(threads) {}

  /// Finds the pose of a frame. The frame's own pose is used only for the first frame, as the start
  /// of the track.
  /// @param mapper Aligns the frame to its map; nothing is fused.
  /// @param frame Depth image, in the camera's optical frame.
  /// @param stamp_s Stamp of the frame in seconds; motion is extrapolated only while stamps
  /// increase.
  /// @throws std::exception when the backend fails.
  Alignment track(Mapper& mapper, const DepthFrame& frame, double stamp_s);

  /// Whether to fuse the last frame of track() at the pose found: only if it fits, or if its pose
  /// was given and the map is still empty there.
  bool shouldFuse(const Alignment& alignment) const;

  /// Continues from a known pose: that of the next frame, in the map frame.
  void setPose(const Eigen::Isometry3d& T_W_C);

  /// Searches for the camera around a pose, for example after a map was loaded. The camera counts
  /// as lost, and nothing is fused, until it is found.
  /// @param near_T_W_C Where to begin the search, in the map frame.
  /// @param stamp_s Stamp of the next frame, in seconds.
  void seek(const Eigen::Isometry3d& near_T_W_C, double stamp_s);

  /// The pose given for the next frame, if any; otherwise the pose of the newest frame that fitted,
  /// or where the search began. Empty before the first frame.
  std::optional<Eigen::Isometry3d> lastPose() const;

  /// The pose predicted for a time after the last frame. Empty before the first frame, while the
  /// camera is lost, and between setPose() and the next frame.
  std::optional<Eigen::Isometry3d> poseAt(double stamp_s) const;

  /// Whether the camera is lost.
  bool isLost() const { return lost_since_s_.has_value(); }

  /// Stamp at which the camera was lost, in seconds; empty while tracking.
  std::optional<double> lostSince_s() const { return lost_since_s_; }

 private:
  Alignment begin(Mapper& mapper, const DepthFrame& frame, double stamp_s);
  Alignment follow(Mapper& mapper, const DepthFrame& frame, double stamp_s);
  Alignment search(Mapper& mapper, const DepthFrame& frame, double stamp_s);
  Alignment searchWholeMap(Mapper& mapper, const DepthFrame& frame, double stamp_s,
                           const Alignment& before);
  Alignment alignAt(Mapper& mapper, DepthFrame frame, const Eigen::Isometry3d& T_W_C);
  void keep(const Eigen::Isometry3d& T_W_C, double stamp_s);
  void rememberPlace(const Eigen::Isometry3d& T_W_C);
  void lose(double stamp_s);
  Eigen::Isometry3d predict(double stamp_s) const;
  Eigen::Isometry3d nextGuess();

  PoseParams params_;
  int threads_;
  std::optional<Eigen::Isometry3d> given_T_W_C_;  ///< Pose of the next frame, if known.
  bool may_begin_ = false;  ///< Whether the last frame may be fused where the map is still empty.
  /// The two newest poses that fitted; `last_` may also be a given pose, or where a search began.
  std::optional<StampedPose> last_, before_;
  std::vector<Eigen::Isometry3d> places_T_W_C_;  ///< Earlier poses, the newest last.
  std::optional<double> lost_since_s_;
  bool was_found_ = false;                ///< Whether the camera was ever found in this map.
  std::optional<double> searched_map_s_;  ///< Stamp of the last search of the whole map.
  double reach_m_ = 0.0;                  ///< Alignment::reach_m of the last alignment.
  int fits_in_a_row_ = 0;                 ///< Images that fitted in a row while lost.
  size_t guesses_made_ = 0;               ///< Guesses tried since the camera was lost.
};

}  // namespace dtsdf
