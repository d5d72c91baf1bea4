#include "parity/recorded_frames.h"

#include "benchmark/raw_frames.h"

namespace dtsdf {

std::vector<TestFrame> readRecordedFrames(const std::string& path_without_suffix) {
  const auto source = openRawFrames(path_without_suffix, FrameSelection());
  std::vector<TestFrame> frames;
  while (const auto recorded = source->next()) {
    TestFrame frame;
    frame.frame = recorded->depth;
    const auto* pixels = static_cast<const unsigned char*>(recorded->depth.data);
    frame.pixels.assign(pixels, pixels + recorded->depth.row_bytes * recorded->depth.height);
    frames.push_back(std::move(frame));
  }
  return frames;
}

}  // namespace dtsdf
