#include "ros/input/image_kind.h"

#include "ros/input/colour_image.h"
#include "ros/input/compressed_image.h"
#include "ros/input/depth_image.h"

namespace dtsdf {

ImageKind makeDepthKind(const InputParams& params) {
  const DepthUnits units{params.unit_16uc1_m, params.unit_32fc1_m};
  return {"depth/image_rect",
          "depth/camera_info",
          "image_transport",
          "compressedDepth",
          decodeDepth,
          0.0,
          Rectification::Kind::kDepth,
          checkDepthImage,
          [units](const CameraImage& camera, PosedFrame& frame) {
            frame.image = makeDepthFrame(camera.image, *camera.info, units, frame.pixels);
          }};
}

ImageKind makeColourKind(const ColourParams& params) {
  return {"color/image_rect",
          "color/camera_info",
          "color_image_transport",
          "compressed",
          decodeColour,
          params.max_rate_hz,
          Rectification::Kind::kColour,
          checkColourImage,
          [](const CameraImage& camera, PosedFrame& frame) {
            frame.image = makeColourFrame(camera.image, *camera.info, frame.pixels);
          }};
}

}  // namespace dtsdf
