#include "parity/recorded_frames.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace dtsdf {
namespace {

bool readPose(const std::string& line, Eigen::Isometry3d& T_W_C) {
  std::istringstream text(line);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) text >> T_W_C.matrix()(row, column);
  }
  return static_cast<bool>(text);
}

}  // namespace

std::vector<TestFrame> readRecordedFrames(const std::string& path_without_suffix) {
  std::ifstream list(path_without_suffix + ".txt");
  std::ifstream images(path_without_suffix + ".raw", std::ios::binary);
  TestFrame frame;
  DepthFrame& depth = frame.frame;
  Intrinsics& K = depth.intrinsics;
  list >> depth.width >> depth.height >> K.fx >> K.fy >> K.cx >> K.cy >> depth.unit_m;
  if (!list || !images) {
    throw std::runtime_error("cannot read " + path_without_suffix + ".txt and .raw");
  }
  depth.row_bytes = depth.width * sizeof(uint16_t);
  frame.pixels.resize(depth.row_bytes * depth.height);
  std::vector<TestFrame> frames;
  std::string line;
  std::getline(list, line);
  while (std::getline(list, line) && readPose(line, depth.T_W_C)) {
    images.read(reinterpret_cast<char*>(frame.pixels.data()), frame.pixels.size());
    if (!images) throw std::runtime_error(path_without_suffix + ".raw is too short");
    frames.push_back(frame);
  }
  return frames;
}

}  // namespace dtsdf
