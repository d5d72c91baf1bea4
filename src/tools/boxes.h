/// Building maps box by box: divides space into boxes, and finds the frames of a recording that
/// each box requires.
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

/// Parses a box in the form of boxText(); bounds are rounded to whole blocks. @throws UsageError if
/// the text is not a box.
BlockExtent parseBox(const std::string& text, double block_m);

/// A run that builds one box of a map.
struct BoxRun {
  MapBox box;        ///< The box; the lists of its frames are filled during the run.
  MapExtent extent;  ///< The blocks to fuse, the blocks to paint, and the cubes of free cells.
  std::shared_ptr<const std::vector<size_t>> frames, images;  ///< Indices of the images to read.
  double last_stamp_s = 0.0;  ///< Stamp of the last frame; later colour images are not used.
};

/// Plans a run from the poses of a recording. If the recording is a folder, decodes few images.
/// @throws std::runtime_error for settings that need the whole map.
BoxRun planBoxRun(RunOptions options, const RunSettings& settings,
                  const std::optional<Eigen::Isometry3d>& T_W_M, const BlockExtent& box);

/// Returns boxes that together cover all of space and divide a recording's surfaces about equally,
/// as estimated from a sample of its images. @throws std::runtime_error if no surface is visible in
/// the sample, or its surfaces lie in fewer blocks than `count`.
/// @param count Number of boxes; 0 for as many as `edge_m` requires.
/// @param edge_m Maximum extent of the surfaces in a box along any axis, in metres; 0 for no limit.
std::vector<BlockExtent> planBoxes(const RunOptions& options, const RunSettings& settings,
                                   size_t count, double edge_m);

/// The space outside the given boxes, as a list of boxes; a single box if possible.
/// @throws std::runtime_error if two of the given boxes overlap.
std::vector<BlockExtent> missingBoxes(const std::vector<BlockExtent>& boxes);

}  // namespace dtsdf
