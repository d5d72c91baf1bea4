#include "ros/input/image_kind.h"

#include <sensor_msgs/image_encodings.h>
#include <boost/make_shared.hpp>

#include <utility>

#include "io/colour_codes.h"
#include "io/depth_codes.h"

namespace dtsdf {

namespace enc = sensor_msgs::image_encodings;

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
  image->data = std::move(decoded.pixels);
  return image;
}

bool holdsColour(const sensor_msgs::CompressedImage& message) {
  const std::string& format = message.format;
  if (holdsDepth(message) || isDepthEncoding(format.substr(0, format.find(';')))) return false;
  const bool names_code = format.find("jpeg") != std::string::npos ||
                          format.find("jpg") != std::string::npos ||
                          format.find("png") != std::string::npos;
  return names_code && format.rfind(enc::MONO8, 0) != 0;
}

sensor_msgs::ImageConstPtr decodeColour(const sensor_msgs::CompressedImage& message) {
  RgbImage decoded = decodeColour(message.data.data(), message.data.size(), "the compressed image");
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = message.header;
  image->encoding = enc::RGB8;
  image->width = static_cast<uint32_t>(decoded.width);
  image->height = static_cast<uint32_t>(decoded.height);
  image->step = 3 * image->width;
  image->data = std::move(decoded.rgb);
  return image;
}

}  // namespace dtsdf
