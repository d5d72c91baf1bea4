/// Tracks a depth camera against the map, image by image.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "dtsdf_mapping/mapper.h"
#include "dtsdf_mapping/params/pose_params.h"

namespace dtsdf {

/// Aligns each image to the map, starting from the pose that the motion between the last two images
/// predicts. If an image does not fit, the camera is lost: nothing is fused, and images are aligned
/// from guesses around earlier poses until several images in a row fit. After two seconds, or
/// immediately if the camera was never located in the map, the whole map is searched
/// (place_search.h). Not thread safe.
class PoseTracker {
 public:
  /// @param params Settings; the sigmas are the expected errors of predicted poses.
  /// @param threads Number of threads for searching the whole map; 0: all cores.
  explicit PoseTracker(const PoseParams& params, int threads = 0)
      : params_(params), threads_(threads) {}

  /// Finds the pose of a frame. The pose in the frame is used only for the first frame, as the
  /// start of the trajectory.
  /// @param mapper Aligns the frame to its map; nothing is fused.
  /// @param frame Depth image, in the camera's optical frame.
  /// @param stamp_s Stamp of the frame, in seconds. Motion is extrapolated only while stamps
  /// increase.
  /// @throws std::exception when the backend fails.
  Alignment track(Mapper& mapper, const DepthFrame& frame, double stamp_s);

  /// Whether to fuse the last frame passed to track() at the resulting pose: only if the frame
  /// fits, or if its pose was supplied and the map is still empty there.
  bool shouldFuse(const Alignment& alignment) const;

  /// Sets the pose of the next frame, from which tracking continues.
  void setPose(const Eigen::Isometry3d& T_W_C);

  /// Starts searching for the camera around a pose, for example after a map was loaded. Until it is
  /// located, the camera counts as lost, and nothing is fused.
  /// @param near_T_W_C Where to start the search, in the map frame.
  /// @param stamp_s Stamp of the next frame, in seconds.
  void seek(const Eigen::Isometry3d& near_T_W_C, double stamp_s);

  /// The pose set for the next frame, if any; otherwise the pose of the newest frame that fitted,
  /// or the start of the search. Empty before the first frame.
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
  bool may_begin_ = false;  ///< Whether to fuse the last frame if the map is still empty there.
  /// The two newest poses that fitted; `last_` may also be a supplied pose, or the start of a
  /// search.
  std::optional<StampedPose> last_, before_;
  std::vector<Eigen::Isometry3d> places_T_W_C_;  ///< Earlier poses, the newest last.
  std::optional<double> lost_since_s_;
  bool was_found_ = false;                ///< Whether the camera was ever located in this map.
  std::optional<double> searched_map_s_;  ///< Stamp of the last search of the whole map.
  double reach_m_ = 0.0;                  ///< Alignment::reach_m of the last alignment.
  int fits_in_a_row_ = 0;  ///< Number of consecutive images that fitted while the camera was lost.
  size_t guesses_made_ = 0;  ///< Number of guesses tried since the camera was lost.
};

}  // namespace dtsdf
