/// Maps by boxes: how space is cut, and what a process that makes one box reads of a recording.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/map_box.h"
#include "map/block_extent.h"
#include "tools/recorded_input.h"
#include "tools/run_options.h"

namespace dtsdf {

/// A box as text: "x=..3.2,y=-1.6..0,z=..", in metres; open where nothing stands.
std::string boxText(const BlockExtent& box, double block_m);

/// Box of such a text, rounded to whole blocks. @throws UsageError
BlockExtent parseBox(const std::string& text, double block_m);

/// A run for one box of a map.
struct BoxRun {
  MapBox box;        ///< With the account of the frames in it.
  MapExtent extent;  ///< What is fused and painted for it.
  std::shared_ptr<const std::vector<size_t>> frames, images;  ///< What is read, by their place.
  double last_stamp_s = 0.0;  ///< Stamp of the last frame: images are painted up to it.
};

/// Looks at poses, and decodes next to no image.
/// @throws std::runtime_error for settings whose rules look at all of the map.
BoxRun planBoxRun(RunOptions options, const RunSettings& settings,
                  const std::optional<Eigen::Isometry3d>& T_W_M, const BlockExtent& box);

/// Boxes that cover all of space and share a recording's surfaces about equally, by a sample of its
/// images. @throws std::runtime_error where there are fewer blocks than boxes.
/// @param count Number of boxes; 0: as many as `edge_m` takes.
/// @param edge_m What a recording shows of a box is no longer than this; 0: any length.
std::vector<BlockExtent> planBoxes(const RunOptions& options, const RunSettings& settings,
                                   size_t count, double edge_m);

/// What of space lies in none of these boxes, in boxes: in one, if it is one.
/// @throws std::runtime_error where two of them overlap.
std::vector<BlockExtent> missingBoxes(const std::vector<BlockExtent>& boxes);

}  // namespace dtsdf
