/// The services that concern poses: setting one, and saving those that were found.
#pragma once

#include <dtsdf_mapping/SaveTrajectory.h>
#include <dtsdf_mapping/SetPose.h>
#include <ros/node_handle.h>

#include <string>

#include "ros/common/worker_thread.h"
#include "ros/session/frame_poses.h"
#include "ros/session/map_poses.h"

namespace dtsdf {

/// Its callbacks wait for the map's thread. They answer that there is nothing to set or save where
/// poses/mode is tf.
class PoseServices {
 public:
  /// What it works with; all of it outlives it.
  struct Parts {
    FramePoses* poses;  ///< Null: poses/mode is tf.
    const MapPoses& map_poses;
    WorkerThread& map_loop;
  };

  /// `nh` has the queue of a thread that may wait.
  PoseServices(ros::NodeHandle nh, std::string output_directory, const Parts& parts);

  /// Nothing is called any more once the queue's thread has stopped.
  void shutdown();

 private:
  bool onSetPose(dtsdf_mapping::SetPose::Request& request,
                 dtsdf_mapping::SetPose::Response& response);
  bool onSaveTrajectory(dtsdf_mapping::SaveTrajectory::Request& request,
                        dtsdf_mapping::SaveTrajectory::Response& response);
  FramePoses& poses() const;

  const std::string output_directory_;
  const Parts parts_;
  ros::ServiceServer set_pose_, save_trajectory_;
};

}  // namespace dtsdf
