#include "evaluation/view_selection.h"

namespace dtsdf {

void addSelectionOptions(CommandLine& line, FrameSelection& frames) {
  line.addWhole({"--first", "N", "first image to use"}, frames.first, {0, kUnbounded});
  line.add({"--last", "N", "last image to use (default: the last)"}, [&](const std::string& text) {
    frames.last = static_cast<size_t>(readWhole(text, {0, kUnbounded}));
  });
  line.addWhole({"--step", "N", "step from one image to the next"}, frames.step, {1, kUnbounded});
}

std::vector<size_t> selectViews(const FrameSelection& frames, size_t count) {
  std::vector<size_t> chosen;
  for (size_t i = frames.first; i < count && i <= frames.last; i += frames.step) {
    chosen.push_back(i);
  }
  if (chosen.empty())
    throw UsageError("the selection contains no image; there are " + std::to_string(count));
  return chosen;
}

}  // namespace dtsdf
