#include "benchmark/raw_frames.h"

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace dtsdf {
namespace {

bool readPose(const std::string& line, Eigen::Isometry3d& T_W_C) {
  std::istringstream text(line);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) text >> T_W_C.matrix()(row, column);
  }
  return static_cast<bool>(text);
}

class RawFrames : public FrameSource {
 public:
  RawFrames(const std::string& name, const FrameSelection& selection)
      : name_(name),
        selection_(selection),
        list_(name + ".txt"),
        images_(name + ".raw", std::ios::binary) {
    Intrinsics& K = frame_.intrinsics;
    list_ >> frame_.width >> frame_.height >> K.fx >> K.fy >> K.cx >> K.cy >> frame_.unit_m;
    if (!list_ || !images_ || frame_.width <= 0 || frame_.height <= 0) {
      throw std::runtime_error("cannot read " + name + ".txt or .raw");
    }
    frame_.row_bytes = frame_.width * sizeof(uint16_t);
  }

  std::optional<SourceFrame> next() override {
    std::string line;
    while (std::getline(list_ >> std::ws, line)) {
      if (!readPose(line, frame_.T_W_C)) {
        throw std::runtime_error(name_ + ".txt: '" + line + "' is not a pose of 12 numbers");
      }
      const size_t index = index_++;
      if (!selection_.contains(index)) continue;
      const size_t pixels = static_cast<size_t>(frame_.width) * frame_.height;
      const auto image = std::make_shared<std::vector<uint16_t>>(pixels);
      const size_t bytes = pixels * sizeof(uint16_t);
      images_.seekg(static_cast<std::streamoff>(index * bytes));
      images_.read(reinterpret_cast<char*>(image->data()), static_cast<std::streamsize>(bytes));
      if (!images_) throw std::runtime_error(name_ + ".raw is too short");
      SourceFrame result;
      result.depth = frame_;
      result.depth.data = image->data();
      result.pixels = image;
      result.index = index;
      return result;
    }
    return std::nullopt;
  }

 private:
  std::string name_;
  FrameSelection selection_;
  std::ifstream list_, images_;
  DepthFrame frame_;  ///< Values common to all frames, and the pose read last.
  size_t index_ = 0;
};

}  // namespace

std::unique_ptr<FrameSource> openRawFrames(const std::string& path_without_suffix,
                                           const FrameSelection& selection) {
  return std::make_unique<RawFrames>(path_without_suffix, selection);
}

}  // namespace dtsdf
