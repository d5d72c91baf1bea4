/// Organised point clouds like those that drivers compute from depth images.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "dtsdf_mapping/pinhole.h"

namespace dtsdf {

/// Layout of the points in a PointCloud2 message.
struct CloudLayout {
  uint8_t datatype = sensor_msgs::PointField::FLOAT32;
  std::string names = "xyz";  ///< Fields in order, after 4 unused bytes.
  uint32_t padding = 4;       ///< Unused bytes after each row.
};

/// Cloud of the points in a depth image in metres. A depth of 0 becomes NaN.
inline sensor_msgs::PointCloud2 makeCloud(const std_msgs::Header& header, const Intrinsics& K,
                                          int width, int height, const std::vector<float>& depth_m,
                                          const CloudLayout& layout = {}) {
  const size_t bytes = layout.datatype == sensor_msgs::PointField::FLOAT64 ? 8 : 4;
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.width = static_cast<uint32_t>(width);
  cloud.height = static_cast<uint32_t>(height);
  cloud.point_step = 4;
  for (const char name : layout.names) {
    cloud.fields.emplace_back();
    cloud.fields.back().name = name;
    cloud.fields.back().offset = cloud.point_step;
    cloud.fields.back().datatype = layout.datatype;
    cloud.fields.back().count = 1;
    cloud.point_step += static_cast<uint32_t>(bytes);
  }
  cloud.row_step = cloud.width * cloud.point_step + layout.padding;
  cloud.data.assign(static_cast<size_t>(cloud.row_step) * cloud.height, 0xee);
  for (int i = 0; i < width * height; ++i) {
    const int u = i % width, v = i / width;
    const float depth = depth_m[static_cast<size_t>(i)];
    const float z = depth > 0.0f ? depth : std::numeric_limits<float>::quiet_NaN();
    const float point[] = {(static_cast<float>(u) - K.cx) * z / K.fx,
                           (static_cast<float>(v) - K.cy) * z / K.fy, z};
    for (const auto& field : cloud.fields) {
      const auto axis = static_cast<size_t>(field.name[0] - 'x');
      const float single = point[axis > 2 ? 0 : axis];
      const double wide = single;
      uint8_t* const value = &cloud.data[static_cast<size_t>(v) * cloud.row_step +
                                         static_cast<size_t>(u) * cloud.point_step + field.offset];
      bytes == 8 ? std::memcpy(value, &wide, 8) : std::memcpy(value, &single, 4);
    }
  }
  return cloud;
}

}  // namespace dtsdf
