/// The step that implements poses/mode: refines the poses from TF or tracks the camera without TF,
/// and publishes the poses as odometry, as a path and in TF.
#pragma once

#include <dtsdf_mapping/PoseStatus.h>
#include <dtsdf_mapping/SaveTrajectory.h>
#include <dtsdf_mapping/SetPose.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <ros/console.h>
#include <tf2_ros/transform_broadcaster.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <utility>
#include <variant>

#include "dtsdf_mapping/pose_refiner.h"
#include "dtsdf_mapping/pose_tracker.h"
#include "io/trajectory.h"
#include "params/printable.h"
#include "params/text.h"
#include "ros/common/requests.h"
#include "ros/common/service.h"
#include "ros/common/status_fields.h"
#include "ros/input/conversions.h"
#include "ros/steps/live_map.h"
#include "ros/steps/map_frame.h"
#include "ros/steps/pose_covariance.h"
#include "ros/steps/step.h"

namespace dtsdf {

/// Aligns images if poses/mode is refine or track; otherwise leaves poses unchanged. With refine,
/// each camera is aligned separately, but only the first camera's correction and poses are
/// published. Serves set_pose and save_trajectory.
class PosesStep : public Step {
 public:
  explicit PosesStep(const Host& host)
      : host_(host),
        params_(host.params),
        parent_(parentOfBase(params_)),
        refiners_(std::max<size_t>(1, params_.cameras.size()), PoseRefiner(params_.poses)),
        last_stamps_(refiners_.size()),
        tracker_(params_.poses, host.params.mapper.threads),
        base_frame_(params_.base_frame),
        report_(refiners_.size()) {}

  void advertise(const Handles& handles) override {
    using namespace dtsdf_mapping;
    if (isOn()) {
      ros::NodeHandle nh = handles.prompt;
      odometry_ = nh.advertise<nav_msgs::Odometry>("odometry", 100);
      path_topic_ = nh.advertise<nav_msgs::Path>("path", 1, true);
      broadcaster_.emplace();
    }
    servers_.push_back(
        serve<SetPose>(handles.waiting, "set_pose", [this](const auto& request, auto& response) {
          requireOn();
          const Eigen::Isometry3d T_W_B =
              host_.frame.find(request.frame_id) * readPose(request.pose);
          host_.map_loop.run([&] { setPose(T_W_B); }).get();
          response.message = "tracking continues from this pose with the next depth image";
        }));
    servers_.push_back(serve<SaveTrajectory>(
        handles.waiting, "save_trajectory",
        [this](const auto& request, auto& response) { save(request.file_name, response); }));
  }

  /// With track, sets a frame's expected pose in M, the frame named by map_frame.
  std::optional<Rejection> expect(PosedFrame& frame) override {
    if (!tracks()) return std::nullopt;
    auto* const depth = std::get_if<DepthFrame>(&frame.image);
    const std::optional<Eigen::Isometry3d> T_W_C =
        depth != nullptr ? tracker_.lastPose() : tracker_.poseAt(frame.stamp.toSec());
    if (depth == nullptr && !T_W_C) {
      return Rejection{drop::kLost, "the pose of the depth camera is unknown"};
    }
    if (depth != nullptr && params_.base_frame.empty()) base_frame_ = frame.frame_id;
    const PoseAnswer mount = mountOf(frame.frame_id);
    if (!mount.T_W_C) return Rejection{drop::kNoTransform, mount.text};
    const Eigen::Isometry3d T_M_W = T_W_M().inverse();
    if (depth == nullptr) {
      std::get<ColourFrame>(frame.image).T_W_C = T_M_W * *T_W_C * T_B_C_.inverse() * *mount.T_W_C;
      return std::nullopt;
    }
    T_B_C_ = *mount.T_W_C;
    depth->T_W_C = T_W_C ? T_M_W * *T_W_C : params_.base_frame.empty() ? uprightCamera() : T_B_C_;
    return std::nullopt;
  }

  /// Replaces a frame's expected pose by the pose at which to fuse or paint it. Both poses are in
  /// W, the frame of the voxels.
  /// @throws std::exception if the backend fails.
  std::optional<Rejection> place(PosedFrame& frame) override {
    if (!isOn()) return std::nullopt;
    const PoseRefiner& refiner = refiners_.at(frame.camera);
    auto* const depth = std::get_if<DepthFrame>(&frame.image);
    if (depth == nullptr) {
      auto& colour = std::get<ColourFrame>(frame.image);
      if (!tracks()) colour.T_W_C = refiner.T_W_O() * colour.T_W_C;
      return std::nullopt;
    }
    found_ = tracks() ? track(frame, *depth) : refine(frame, *depth);
    depth->T_W_C = found_.T_W_C;
    recordAlignment(frame, found_);
    if (tracks() ? tracker_.shouldFuse(found_) : refiner.shouldFuse(found_)) return std::nullopt;
    const std::string text =
        formatted("%s: %ld %% of the points are near surfaces, and %ld %% of these are inliers",
                  toString(found_.status), std::lround(100.0 * found_.matched_share),
                  std::lround(100.0 * found_.inlier_share));
    return Rejection{tracks() ? drop::kLost : drop::kMisfit, text};
  }

  void fused(const PosedFrame& frame, const IntegrationResult& result) override {
    if (!isOn() || result.status != FrameStatus::kFused) return;
    const auto* const depth = std::get_if<DepthFrame>(&frame.image);
    if (depth == nullptr || frame.camera != 0) return;
    fused_.push_back({frame.stamp.toSec(), depth->T_W_C});
    if (fused_.size() > kMaxPoses) fused_.pop_front();
    // B is poses/base_frame or, if that is empty, the camera's frame.
    const std::string& base = params_.base_frame.empty() ? frame.frame_id : params_.base_frame;
    PoseAnswer mount{T_B_C_};
    if (!tracks() && base != frame.frame_id) {
      mount = host_.transforms.find(base, frame.frame_id, ros::Time(0));
    }
    published_.reset();
    if (mount.T_W_C) publish(frame.stamp, base, mount.T_W_C->inverse());
  }

  /// When the map is emptied, a tracked camera keeps its pose. When a map is loaded, the camera may
  /// be anywhere in it and must be relocalised.
  void replaced(const MapContents*, const std::shared_ptr<const MapChunks>&) override {
    if (!isOn()) return;
    must_relocalise_ = true;
    fused_.clear();
    if (broadcaster_) path_topic_.publish(emptyPath());  // the path starts over with the map
  }

  void fill(MapStatus& status) override {
    if (!isOn()) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    for (size_t i = 0; i < std::min(report_.size(), status.cameras.size()); ++i) {
      status.cameras[i].pose = report_[i];
      if (report_[i].lost_since.isZero()) continue;
      report(status, MapStatus::WARN, MapStatus::CAMERA_LOST,
             "the camera is lost, and nothing is fused: move it back slowly to where it was, call "
             "set_pose, or start over with clear_map");
    }
    if (problem_.empty()) return;
    report(status, MapStatus::WARN, MapStatus::POSES_NOT_PUBLISHED, problem_);
  }

  /// Sets the pose of B for the next image. @throws std::runtime_error unless poses/mode is track.
  void setPose(const Eigen::Isometry3d& T_W_B) {
    if (!tracks()) {
      throw std::runtime_error(
          "poses come from TF, because poses/mode is refine; set_pose needs poses/mode: track");
    }
    given_T_W_B_ = T_W_B;
  }

  /// Poses at which the first camera's frames were fused, in order of fusion; at most the newest
  /// kMaxPoses.
  const std::deque<StampedPose>& fusedPoses() const { return fused_; }
  /// The latest odometry, set even without listeners.
  const std::optional<nav_msgs::Odometry>& published() const { return published_; }
  /// With refine, maps the first camera's poses from TF to refined poses, in M.
  const Eigen::Isometry3d& T_M_O() const { return T_M_O_; }

 private:
  /// Maximum length of the trajectory: over three hours at 30 images per second.
  static constexpr size_t kMaxPoses = 360000;

  bool isOn() const { return params_.poses.mode != PoseMode::kTf; }
  bool tracks() const { return params_.poses.mode == PoseMode::kTrack; }

  /// @throws std::runtime_error if poses come from TF unchanged.
  void requireOn() const {
    if (isOn()) return;
    throw std::runtime_error(
        "poses come from TF unchanged; start the node with poses/mode: track or refine");
  }

  static std::string parentOfBase(const NodeParams& params) {
    const bool tracks = params.poses.mode == PoseMode::kTrack;
    return tracks && !params.odom_frame.empty() ? params.odom_frame : params.map_frame;
  }

  /// Pose of an upright camera in a frame with x forward and z up. Tracking begins there unless
  /// poses/base_frame is set.
  static Eigen::Isometry3d uprightCamera() {
    Eigen::Isometry3d T_B_C = Eigen::Isometry3d::Identity();
    T_B_C.linear() << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
    return T_B_C;
  }

  void save(const std::string& file_name, dtsdf_mapping::SaveTrajectory::Response& response) {
    requireOn();
    std::vector<StampedPose> poses;
    host_.map_loop.run([&] { poses.assign(fused_.begin(), fused_.end()); }).get();
    const std::string path =
        resolveOutputPath(params_.output_directory, file_name, {".txt", ".tum"});
    if (poses.empty()) {
      throw std::runtime_error(
          "there is no pose yet: no frame has been fused since the start, clear_map or load_map");
    }
    saveTrajectory(poses, path);
    response.path = path;
    response.poses = poses.size();
    response.message = "saved " + std::to_string(poses.size()) + " poses to " + path;
  }

  /// Pose of a camera in B.
  PoseAnswer mountOf(const std::string& camera_frame) const {
    if (camera_frame == base_frame_) return {Eigen::Isometry3d::Identity()};
    return host_.transforms.find(base_frame_, camera_frame, ros::Time(0));
  }

  Eigen::Isometry3d T_W_M() const {
    return host_.frame.level().value_or(Eigen::Isometry3d::Identity());
  }

  /// If stamps jump back, a recording or the odometry has restarted, so the refiner is reset.
  Alignment refine(const PosedFrame& frame, const DepthFrame& depth) {
    PoseRefiner& refiner = refiners_.at(frame.camera);
    const ros::Time last = std::exchange(last_stamps_.at(frame.camera), frame.stamp);
    if (last.toSec() - frame.stamp.toSec() > kTimeJump_s) refiner = PoseRefiner(params_.poses);
    Alignment alignment = refiner.refine(host_.map.mapper(), depth);
    if (frame.camera != 0) return alignment;
    T_M_O_ = T_W_M().inverse() * refiner.T_W_O() * T_W_M();
    if (broadcaster_ && !params_.odom_frame.empty()) {
      sendTransform(params_.map_frame, params_.odom_frame, T_M_O_, frame.stamp);
    }
    return alignment;
  }

  /// The camera keeps its pose while the map is empty, because there is nothing to align it to.
  Alignment track(const PosedFrame& frame, const DepthFrame& depth) {
    const std::optional<Eigen::Isometry3d> last_T_W_C = tracker_.lastPose();
    if (given_T_W_B_) {
      tracker_.setPose(*given_T_W_B_ * T_B_C_);
    } else if (host_.map.mapper().stats().voxel_arrays == 0) {
      if (last_T_W_C) tracker_.setPose(*last_T_W_C);
    } else if (must_relocalise_ || !last_T_W_C) {
      tracker_.seek(depth.T_W_C, frame.stamp.toSec());
    }
    given_T_W_B_.reset();
    must_relocalise_ = false;
    return tracker_.track(host_.map.mapper(), depth, frame.stamp.toSec());
  }

  void recordAlignment(const PosedFrame& frame, const Alignment& alignment) {
    const auto toVectors = [](const std::vector<Eigen::Vector3d>& axes) {
      std::vector<geometry_msgs::Vector3> vectors;
      for (const Eigen::Vector3d& axis : axes) tf2::toMsg(axis, vectors.emplace_back());
      return vectors;
    };
    dtsdf_mapping::PoseStatus status;
    status.outcome = toString(alignment.status);
    status.stamp = frame.stamp;
    status.matched_share = static_cast<float>(alignment.matched_share);
    status.inlier_share = static_cast<float>(alignment.inlier_share);
    status.residual_m = static_cast<float>(alignment.residual_m);
    status.correction_m = static_cast<float>(alignment.shift_m);
    status.correction_rad = static_cast<float>(alignment.turn_rad);
    const PoseParams& params = params_.poses;
    status.free_shifts =
        toVectors(freeAxes(alignment.covariance.topLeftCorner<3, 3>(), params.sigma_m));
    status.free_turns =
        toVectors(freeAxes(alignment.covariance.bottomRightCorner<3, 3>(), params.sigma_rad));
    status.lost_since = toTime(tracks() ? tracker_.lostSince_s().value_or(0.0) : 0.0);
    const std::lock_guard<std::mutex> lock(mutex_);
    report_.at(frame.camera) = std::move(status);
  }

  /// Publishes the odometry, the path and, with track, the pose in TF.
  void publish(const ros::Time& stamp, const std::string& base, const Eigen::Isometry3d& T_C_B) {
    // Variance that marks the speeds as not measured.
    constexpr double kNoSpeed = 1e6;
    const Eigen::Isometry3d T_M_W = T_W_M().inverse();
    const Eigen::Isometry3d T_W_B = found_.T_W_C * T_C_B, T_M_B = T_M_W * T_W_B;
    nav_msgs::Odometry& odometry = published_.emplace();
    odometry.header.stamp = stamp;
    odometry.header.frame_id = parent_;
    odometry.child_frame_id = base;
    odometry.pose.pose = tf2::toMsg(T_M_B);
    using RowByRow = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
    Eigen::Map<RowByRow>(odometry.pose.covariance.data()) =
        movedCovariance(odometryCovariance(found_, params_.poses), T_M_W.linear(),
                        T_M_W.linear() * (T_W_B.translation() - found_.T_W_C.translation()));
    Eigen::Map<RowByRow>(odometry.twist.covariance.data()).diagonal().setConstant(kNoSpeed);
    if (!broadcaster_) return;
    odometry_.publish(odometry);
    publishPath(stamp, T_C_B);
    if (!tracks()) return;
    const bool has_parent =
        parent_ == params_.map_frame ||
        sendTransform(params_.map_frame, parent_, Eigen::Isometry3d::Identity(), stamp);
    if (has_parent) sendTransform(parent_, base, T_M_B, stamp);
  }

  /// Publishes the trajectory so far, thinned out if it is long.
  void publishPath(const ros::Time& stamp, const Eigen::Isometry3d& T_C_B) {
    constexpr size_t kMaxOnPath = 4000;
    constexpr std::chrono::milliseconds kPathPeriod{500};
    const SteadyTime now = std::chrono::steady_clock::now();
    if (path_topic_.getNumSubscribers() == 0 || now - path_sent_ < kPathPeriod) return;
    path_sent_ = now;
    nav_msgs::Path path = emptyPath();
    path.header.stamp = stamp;
    for (size_t i = 0; i < fused_.size(); i += 1 + fused_.size() / kMaxOnPath) {
      path.poses.emplace_back();
      path.poses.back().header.frame_id = path.header.frame_id;
      path.poses.back().header.stamp = toTime(fused_[i].stamp_s);
      path.poses.back().pose = tf2::toMsg(fused_[i].T_W_C * T_C_B);
    }
    path_topic_.publish(path);
  }

  nav_msgs::Path emptyPath() const {
    nav_msgs::Path path;
    path.header.frame_id = frameOfMap(params_);
    return path;
  }

  /// Broadcasts a transform, unless another publisher gives the child a different parent.
  bool sendTransform(const std::string& parent, const std::string& child,
                     const Eigen::Isometry3d& T, const ros::Time& stamp) {
    const std::string other = host_.transforms.otherParentOf(child, parent, stamp);
    if (other.empty()) broadcaster_->sendTransform(makeTransform(parent, child, T, stamp));
    const std::string problem =
        "poses are not published in TF, where '" + printable(child) + "' already has the parent '" +
        printable(other) +
        "': set poses/base_frame to the root of the camera's own frames, or stop the other " +
        "publisher of the pose";
    const std::lock_guard<std::mutex> lock(mutex_);
    problem_ = other.empty() ? "" : problem;
    return other.empty();
  }

  const Host& host_;
  const NodeParams& params_;
  const std::string parent_;  ///< Name of the frame in which poses are published.
  // With refine, for each camera: its refiner, and the stamp of its newest depth image.
  std::vector<PoseRefiner> refiners_;
  std::vector<ros::Time> last_stamps_;
  PoseTracker tracker_;
  std::string base_frame_;                                   ///< Name of B, once it is known.
  Eigen::Isometry3d T_B_C_ = Eigen::Isometry3d::Identity();  ///< With track, from the newest image.
  std::optional<Eigen::Isometry3d> given_T_W_B_;  ///< Set by setPose(), for the next image.
  bool must_relocalise_ = false;                  ///< Applies to the next image; see replaced().
  Alignment found_;                               ///< Alignment of the newest image.
  std::optional<nav_msgs::Odometry> published_;
  Eigen::Isometry3d T_M_O_ = Eigen::Isometry3d::Identity();
  std::deque<StampedPose> fused_;

  ros::Publisher odometry_, path_topic_;
  /// Set by advertise(), unless poses/mode is tf.
  std::optional<tf2_ros::TransformBroadcaster> broadcaster_;
  SteadyTime path_sent_{};
  std::vector<ros::ServiceServer> servers_;

  mutable std::mutex mutex_;                       ///< Guards the members below.
  std::vector<dtsdf_mapping::PoseStatus> report_;  ///< One for each camera.
  std::string problem_;                            ///< Why a transform is not published, or empty.
};

}  // namespace dtsdf
