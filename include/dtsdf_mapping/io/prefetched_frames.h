/// Reads frames ahead on a thread of its own, so that decoding and fusing overlap.
#pragma once

#include <memory>

#include "dtsdf_mapping/io/frame_source.h"

namespace dtsdf {

/// The frames of a source in their order, the next one decoded in advance.
/// An error of the inner source is thrown by next() in its turn, after the frames before it.
/// skipped() counts what was skipped before the frame handed out last.
std::unique_ptr<FrameSource> prefetchFrames(std::unique_ptr<FrameSource> source);

}  // namespace dtsdf
