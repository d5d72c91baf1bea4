#include "ros/session/pose_services.h"

#include <stdexcept>
#include <utility>
#include <vector>

#include "io/trajectory_file.h"
#include "ros/output/output_path.h"
#include "ros/session/answer.h"
#include "ros/session/pose_request.h"

namespace dtsdf {

PoseServices::PoseServices(ros::NodeHandle nh, std::string output_directory, const Parts& parts)
    : output_directory_(std::move(output_directory)),
      parts_(parts),
      set_pose_(nh.advertiseService("set_pose", &PoseServices::onSetPose, this)),
      save_trajectory_(
          nh.advertiseService("save_trajectory", &PoseServices::onSaveTrajectory, this)) {}

void PoseServices::shutdown() {
  set_pose_.shutdown();
  save_trajectory_.shutdown();
}

FramePoses& PoseServices::poses() const {
  if (parts_.poses != nullptr) return *parts_.poses;
  throw std::runtime_error(
      "poses come from TF as they are; start the node with poses/mode: track, "
      "or refine");
}

bool PoseServices::onSetPose(dtsdf_mapping::SetPose::Request& request,
                             dtsdf_mapping::SetPose::Response& response) {
  answer("set_pose", response, [&] {
    FramePoses& poses = this->poses();
    const Eigen::Isometry3d T_W_B =
        parts_.map_poses.find(request.frame_id) * readPose(request.pose);
    parts_.map_loop.run([&] { poses.setPose(T_W_B); }).get();
    response.message = "the next depth image is tracked from there";
  });
  return true;
}

bool PoseServices::onSaveTrajectory(dtsdf_mapping::SaveTrajectory::Request& request,
                                    dtsdf_mapping::SaveTrajectory::Response& response) {
  answer("save_trajectory", response, [&] {
    const FramePoses& poses = this->poses();
    const std::string path =
        resolveOutputPath(output_directory_, request.file_name, {".txt", ".tum"});
    size_t left_out = 0;
    const std::vector<StampedPose> trajectory = parts_.map_loop
                                                    .run([&] {
                                                      left_out = poses.fusedPoses().leftOut();
                                                      return poses.fusedPoses().copy();
                                                    })
                                                    .get();
    if (trajectory.empty()) {
      throw std::runtime_error(
          "there is no pose yet: no frame has been fused since the start, "
          "clear_map or load_map");
    }
    saveTrajectory(trajectory, path);
    response.path = path;
    response.poses = trajectory.size();
    response.message = "saved " + std::to_string(trajectory.size()) + " poses to " + path;
    if (left_out > 0) {
      response.message += "; " + std::to_string(left_out) + " older ones are no longer kept";
    }
  });
  return true;
}

}  // namespace dtsdf
