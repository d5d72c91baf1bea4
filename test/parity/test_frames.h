/// Frames for comparing backends: an analytic room viewed by a moving camera, with the defects of
/// real depth images.
#pragma once

#include <cstdint>
#include <vector>

#include "dtsdf_mapping/mapper.h"

namespace dtsdf {

/// A depth image that owns its pixels.
struct TestFrame {
  DepthFrame frame;  ///< Its `data` is null; view() sets it.
  std::vector<unsigned char> pixels;

  DepthFrame view() const {
    DepthFrame copy = frame;
    copy.data = pixels.data();
    return copy;
  }
};

struct TestFrameSettings {
  int width = 160, height = 120;
  int count = 4;
  DepthEncoding encoding = DepthEncoding::kUint16;
  bool noise = false;  ///< Noise that grows with depth squared, and holes: NaN in float images.
  double first_s = 0.0, step_s = 0.4;                  ///< Times along roomCameraPose().
  Eigen::Vector3d offset_W = Eigen::Vector3d::Zero();  ///< Moves room and camera.
};

std::vector<TestFrame> makeTestFrames(const TestFrameSettings& settings);

/// A colour image that owns its pixels.
struct TestColours {
  ColourFrame frame;  ///< Its `data` is null; view() sets it.
  std::vector<unsigned char> pixels;

  ColourFrame view() const {
    ColourFrame copy = frame;
    copy.data = pixels.data();
    return copy;
  }
};

/// One image per depth image, from a camera next to the depth camera: a pattern with noise, whose
/// brightness changes between images.
std::vector<TestColours> makeTestColours(const TestFrameSettings& settings, int width = 150,
                                         int height = 110,
                                         ColourEncoding encoding = ColourEncoding::kBgr8);

}  // namespace dtsdf
