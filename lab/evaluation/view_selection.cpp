#include "evaluation/view_selection.h"

namespace dtsdf {

void addSelectionOptions(CommandLine& line, FrameSelection& frames) {
  line.addWhole({"--first", "N", "the first image to use"}, frames.first, {0, kUnbounded});
  line.add({"--last", "N", "the last one (default: the last there is)"},
           [&](const std::string& text) {
             frames.last = static_cast<size_t>(readWhole(text, {0, kUnbounded}));
           });
  line.addWhole({"--step", "N", "the way from one to the next"}, frames.step, {1, kUnbounded});
}

std::vector<size_t> selectViews(const FrameSelection& frames, size_t count) {
  std::vector<size_t> chosen;
  for (size_t i = frames.first; i < count && i <= frames.last; i += frames.step) {
    chosen.push_back(i);
  }
  if (chosen.empty()) throw UsageError("no image is chosen; there are " + std::to_string(count));
  return chosen;
}

}  // namespace dtsdf
