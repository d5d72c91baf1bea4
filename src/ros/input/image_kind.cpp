#include "ros/input/image_kind.h"

#include "ros/input/colour_image.h"
#include "ros/input/depth_image.h"

namespace dtsdf {

ImageKind makeDepthKind(const InputParams& params) {
  const DepthUnits units{params.unit_16uc1_m, params.unit_32fc1_m};
  return {Rectification::Kind::kDepth, checkDepthImage,
          [units](const CameraImage& camera, PosedFrame& frame) {
            frame.image = makeDepthFrame(camera.image, *camera.info, units, frame.pixels);
          }};
}

ImageKind makeColourKind() {
  return {Rectification::Kind::kColour, checkColourImage,
          [](const CameraImage& camera, PosedFrame& frame) {
            frame.image = makeColourFrame(camera.image, *camera.info, frame.pixels);
          }};
}

}  // namespace dtsdf
