/// Maps by boxes: how space is cut, and what a process that makes one box reads of a recording.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "map/block_extent.h"
#include "tools/recorded_input.h"
#include "tools/run_options.h"

namespace dtsdf {

/// A box as text: "x=..3.2,y=-1.6..0,z=..", in metres; open where nothing stands.
std::string boxText(const BlockExtent& box, double block_m);

/// And back, rounded to whole blocks. @throws UsageError
BlockExtent parseBox(const std::string& text, double block_m);

/// What a process reads that makes one box of a map.
struct BoxInput {
  MapExtent extent;
  std::shared_ptr<const std::vector<size_t>> frames, images;  ///< By their place.
  double last_stamp_s = 0.0;  ///< Of the recording's frames: images are painted up to it.
};

/// Looks at poses, and decodes next to no image.
/// @throws std::runtime_error for settings whose rules look at all of the map.
BoxInput findBoxInput(const InputOptions& options, const RunSettings& settings,
                      const std::optional<Eigen::Isometry3d>& T_W_M, const BlockExtent& box);

/// How space is cut.
struct BoxPlan {
  size_t count = 0;     ///< Boxes; 0: as many as `edge_m` takes.
  double edge_m = 0.0;  ///< What a recording shows of a box is no longer than this; 0: any length.
};

/// Boxes that cover all of space and share a recording's surfaces about equally, by a sample of its
/// images. @throws std::runtime_error where there are fewer blocks than boxes.
std::vector<BlockExtent> planBoxes(const InputOptions& options, const RunSettings& settings,
                                   const BoxPlan& plan);

/// What of space lies in none of these boxes, in as few boxes as it takes.
/// @throws std::runtime_error where two of them overlap.
std::vector<BlockExtent> missingBoxes(const std::vector<BlockExtent>& boxes);

}  // namespace dtsdf
