/// Reads frames ahead on a thread of its own, so that decoding and fusing overlap.
#pragma once

#include <memory>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// Wraps a source so that the next frame is decoded in advance. An error of the source is thrown by
/// next() after the frames that precede it. skipped() counts the images skipped before the frame
/// that next() returned last.
std::unique_ptr<FrameSource> prefetchFrames(std::unique_ptr<FrameSource> source);

}  // namespace dtsdf
