/// What calls of services and paths give: poses, regions, points, and names of files.
#pragma once

#include <dtsdf_mapping/Box.h>
#include <dtsdf_mapping/GetDistances.h>
#include <dtsdf_mapping/Sphere.h>
#include <geometry_msgs/Pose.h>
#include <nav_msgs/Path.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "dtsdf_mapping/region.h"
#include "dtsdf_mapping/space.h"
#include "io/trajectory.h"

namespace dtsdf {

/// An orientation of all zeros is none. @throws std::runtime_error if it is not a rotation either,
/// or the position is not finite.
Eigen::Isometry3d readPose(const geometry_msgs::Pose& pose);

/// Nothing if the size is all zeros. @throws std::runtime_error for a box with a problem, with what
/// it is.
std::optional<BoxRegion> readBox(const dtsdf_mapping::Box& box);

/// The one of both that is given.
/// @throws std::runtime_error if none is, or both are, or it has a problem; the text says what to
/// do.
Region readRegion(const dtsdf_mapping::Box& box, const dtsdf_mapping::Sphere& sphere);

/// A region of frame F in the map frame.
Region inMap(const Region& region, const Eigen::Isometry3d& T_W_F);

/// Before any frame is looked up.
/// @throws std::runtime_error for too many points, or one that is not finite.
void checkPoints(const std::vector<geometry_msgs::Point>& points);

/// Of points of frame F; gradients are turned into it.
void fillAnswer(const KnownSpace& space, const std::vector<geometry_msgs::Point>& points,
                const Eigen::Isometry3d& T_W_F, dtsdf_mapping::GetDistances::Response& response);

/// A path that may start with "~/" or be "~", the home folder.
/// @throws std::runtime_error if HOME is not set; `name` says whose path it is.
std::string expandHome(const std::string& path, const std::string& name);

/// The absolute path of a file under `output_directory`, which may start with "~/". `extensions`
/// are those that are allowed, in any case, as in {".ply", ".obj"}. What is read may lie anywhere.
/// @throws std::runtime_error if the name is empty or has control characters, lies outside the
/// directory, also by a symbolic link, or has another extension; the text says what to do.
std::string resolveOutputPath(const std::string& output_directory, const std::string& file_name,
                              const std::vector<std::string>& extensions, bool is_read = false);

/// Corrected poses as they come from outside.
struct GivenPoses {
  std::vector<StampedPose> poses;  ///< Of `child_frame`, in `frame_id`.
  std::string frame_id;            ///< Empty: the map's frame.
  std::string child_frame;         ///< Empty: the optical frame of the first camera.
};

/// @throws std::runtime_error for a pose that cannot be, or the name of a frame that is too long.
GivenPoses readPath(const nav_msgs::Path& path, const std::string& child_frame);

}  // namespace dtsdf
