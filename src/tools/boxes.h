/// Maps made box by box: how space is divided, and which frames of a recording a box needs.
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

/// A box as text: "x=..3.2,y=-1.6..0,z=..", in metres; an omitted bound is open.
std::string boxText(const BlockExtent& box, double block_m);

/// Parses a box in the form of boxText(); bounds are rounded to whole blocks. @throws UsageError
BlockExtent parseBox(const std::string& text, double block_m);

/// A run for one box of a map.
struct BoxRun {
  MapBox box;        ///< The box and the numbers of its frames.
  MapExtent extent;  ///< Blocks to fuse and to paint, and cubes of cells.
  std::shared_ptr<const std::vector<size_t>> frames, images;  ///< Indices of what to read.
  double last_stamp_s = 0.0;  ///< Stamp of the last frame; later images are not painted.
};

/// Plans a run from poses. Decodes only a few images of a recording in a folder.
/// @throws std::runtime_error for settings that need the whole map.
BoxRun planBoxRun(RunOptions options, const RunSettings& settings,
                  const std::optional<Eigen::Isometry3d>& T_W_M, const BlockExtent& box);

/// Boxes that cover all of space and divide a recording's surfaces about equally, judged by a
/// sample of its images. @throws std::runtime_error if the sample shows no surface, or fewer blocks
/// than boxes.
/// @param count Number of boxes; 0: as many as `edge_m` requires.
/// @param edge_m Largest extent of the surfaces in a box along an axis, in metres; 0: no limit.
std::vector<BlockExtent> planBoxes(const RunOptions& options, const RunSettings& settings,
                                   size_t count, double edge_m);

/// The space outside these boxes, as boxes; if possible, as one box.
/// @throws std::runtime_error if two of them overlap.
std::vector<BlockExtent> missingBoxes(const std::vector<BlockExtent>& boxes);

}  // namespace dtsdf
