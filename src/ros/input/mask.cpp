#include "ros/input/mask.h"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <sstream>

#include "params/printable.h"

namespace dtsdf {
namespace {

namespace enc = sensor_msgs::image_encodings;

bool hasAllRows(const sensor_msgs::Image& mask) {
  return mask.step >= mask.width &&
         mask.data.size() >= static_cast<size_t>(mask.step) * (mask.height - 1) + mask.width;
}

}  // namespace

std::optional<Rejection> checkMask(const sensor_msgs::Image& mask,
                                   const sensor_msgs::Image& depth) {
  if (mask.encoding != enc::MONO8 && mask.encoding != enc::TYPE_8UC1) {
    return Rejection{DropReason::kBadEncoding,
                     "a mask of encoding '" + printable(mask.encoding) + "'; it must be mono8"};
  }
  if (mask.width != depth.width || mask.height != depth.height) {
    std::ostringstream text;
    text << "the mask is " << mask.width << " x " << mask.height << ", but its image "
         << depth.width << " x " << depth.height;
    return Rejection{DropReason::kSizeMismatch, text.str()};
  }
  if (hasAllRows(mask)) return std::nullopt;
  return Rejection{DropReason::kBadImage, "the mask has fewer bytes than pixels"};
}

sensor_msgs::ImageConstPtr applyMask(const sensor_msgs::Image& mask,
                                     const sensor_msgs::Image& depth) {
  const size_t pixel_bytes = static_cast<size_t>(enc::bitDepth(depth.encoding)) / 8;
  const auto masked = boost::make_shared<sensor_msgs::Image>(depth);
  for (size_t v = 0; v < depth.height; ++v) {
    for (size_t u = 0; u < depth.width; ++u) {
      if (mask.data[v * mask.step + u] == 0) continue;
      // 0 is no measurement in each encoding and byte order, and its bytes are all 0.
      std::fill_n(&masked->data[v * depth.step + u * pixel_bytes], pixel_bytes, uint8_t{0});
    }
  }
  return masked;
}

}  // namespace dtsdf
