#include "ros/input/compressed_image.h"

#include <boost/make_shared.hpp>
#include <utility>

#include "io/byte_order.h"
#include "io/compressed_depth.h"
#include "ros/input/depth_image.h"

namespace dtsdf {

bool holdsDepth(const sensor_msgs::CompressedImage& message) {
  return isDepthEncoding(encodingOfCompressedDepth(message.format));
}

sensor_msgs::ImageConstPtr decodeDepth(const sensor_msgs::CompressedImage& message) {
  DecodedDepth decoded = decodeCompressedDepth(message.format, message.data);
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = message.header;
  image->encoding = std::move(decoded.encoding);
  image->width = static_cast<uint32_t>(decoded.size.width);
  image->height = static_cast<uint32_t>(decoded.size.height);
  image->step = static_cast<uint32_t>(decoded.pixels.size() / image->height);
  image->is_bigendian = !hostIsLittleEndian();
  image->data = std::move(decoded.pixels);
  return image;
}

}  // namespace dtsdf
