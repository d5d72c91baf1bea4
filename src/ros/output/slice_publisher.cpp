#include "ros/output/slice_publisher.h"

#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>

namespace dtsdf {
namespace {

ros::AdvertiseOptions advertiseOptions() {
  ros::AdvertiseOptions options;
  options.init<sensor_msgs::PointCloud2>("distance_slice", 1);
  return options;
}

}  // namespace

SlicePublisher::SlicePublisher(const ros::NodeHandle& nh, const std::string& map_frame,
                               double height_m)
    : map_frame_(map_frame), height_m_(height_m), topic_(nh, advertiseOptions()) {}

void SlicePublisher::put(const SpaceSlice& slice) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = map_frame_;
  cloud.header.stamp = slice.stamp;
  cloud.height = 1;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(4, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "intensity", 1,
                                kFloat);
  modifier.resize(slice.cells.size());
  sensor_msgs::PointCloud2Iterator<float> next(cloud, "x");
  for (const SliceCell& cell : slice.cells) {
    const Eigen::Vector3f p = pointInSlice(cell, slice.cell_size_m, height_m_).cast<float>();
    next[0] = p.x();
    next[1] = p.y();
    next[2] = p.z();
    next[3] = cell.distance_m;
    ++next;
  }
  newest_ = ros::serialization::serializeMessage(cloud);
  topic_.outdate();
}

void SlicePublisher::serve() {
  for (const auto& link : topic_.links()) {
    if (newest_ && link->lacksNewest()) topic_.send(*link, *newest_);
  }
}

}  // namespace dtsdf
